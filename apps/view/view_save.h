// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "apps/cli/options.h"
#include "view/server/viewer.h"

namespace tetwarp::apps {

/// What the deformed volume may be saved as: suffixes of files, and "dicom" for a series.
std::vector<std::string> saved_volume_kinds(bool is_dicom);

/// Writes what a hand did or what was shown, and what comes of it, on a thread of its own, into one folder. Volumes,
/// fields and films are made by `deform`, `simulate` and `render`, whose commands are told.
class Saving {
 public:
  using Saved = viewer::Viewer::Saved;

  explicit Saving(const ViewOptions& options);
  /// Ends before the next job.
  ~Saving();
  Saving(const Saving&) = delete;
  Saving& operator=(const Saving&) = delete;

  /// Begins; comes back at once. @param done  is called by the thread that writes
  void begin(viewer::SaveJob job, std::function<void(Saved)> done);

 private:
  class One;

  void run(const std::stop_token& stop);

  const ViewOptions options_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::pair<viewer::SaveJob, std::function<void(Saved)>>> jobs_;
  std::jthread thread_;
};

}  // namespace tetwarp::apps
