// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <tbb/global_control.h>

#include <cstddef>
#include <optional>

namespace tetwarp::apps {

/// The threads of a batch, as many as the system gives. A limit of the user or of the control group (`ulimit -u`,
/// pids.max) lets the batch work with fewer threads instead of failing. oneTBB ends the process where it cannot start a
/// thread, so its threads are started here, while it is known that the system gives them.
class Threads {
 public:
  /// @param jobs  number of cases to run at once, if the system gives enough threads
  explicit Threads(std::size_t jobs);

  /// Number of cases for which there are threads.
  std::size_t jobs() const { return jobs_; }
  /// Number of threads that the system gives, if it is fewer than needed.
  std::optional<std::size_t> limit() const { return limit_; }

 private:
  std::size_t jobs_;
  std::optional<std::size_t> limit_;
  std::optional<tbb::global_control> fewer_workers_;
};

}  // namespace tetwarp::apps
