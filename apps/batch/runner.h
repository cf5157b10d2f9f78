// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "apps/batch/progress.h"
#include "apps/batch/results.h"
#include "apps/batch/usage.h"

namespace tetwarp::apps {

/// Runs cases side by side: while one is read, another is resampled and a third is written. Each takes the memory and
/// the devices that it needs, in the order of the manifest.
class Runner {
 public:
  struct Parts {
    Resources resources;
    Results& results;
    BatchProgress& progress;
    Usage& usage;
  };

  Runner(std::vector<const BatchCase*> cases, const Parts& parts) : cases_(std::move(cases)), parts_(parts) {}

  /// Runs all cases, at most `jobs` at a time.
  /// @return false where it was interrupted. Cases in work are then dropped, or finish soon. If one does neither for
  /// some seconds, `abandon` is called, which has to end the process.
  /// @throws Error where results cannot be written
  bool run(std::size_t jobs, const std::function<void()>& abandon);

 private:
  std::vector<std::jthread> start(std::size_t jobs);
  void work();

  std::vector<const BatchCase*> cases_;
  Parts parts_;
  std::atomic<std::size_t> next_ = 0;
  std::exception_ptr failure_;
  std::size_t working_ = 0;
  std::mutex mutex_;
  std::condition_variable ended_;
};

}  // namespace tetwarp::apps
