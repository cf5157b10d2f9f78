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

namespace tetwarp::apps {

/// What the deformed volume may be saved as: suffixes of files, and "dicom" for a series.
std::vector<std::string> saved_volume_kinds(bool is_dicom);

/// Writes what a hand did, and the volume that comes of it, on a thread of its own. Names come from a page, so only
/// letters, digits, hyphens and underscores are taken, and all files go into one folder.
class Saving {
 public:
  struct Wish {
    std::string name, volume;  ///< see `viewer::request::Save`
    std::string scenario;      ///< text of the file
  };
  struct Result {
    std::vector<std::string> files;  ///< that were written
    std::string command;             ///< that makes the volume again
    std::string problem;             ///< why it failed; empty: it did not
  };
  explicit Saving(const ViewOptions& options);
  /// Ends before the next wish.
  ~Saving();
  Saving(const Saving&) = delete;
  Saving& operator=(const Saving&) = delete;

  /// Begins; comes back at once. @param done  is called by the thread that writes
  void begin(Wish wish, std::function<void(Result)> done);

 private:
  Result save(const Wish& wish) const;
  void write_scenario(const std::filesystem::path& path, const std::string& text) const;
  void run(const std::stop_token& stop);

  const ViewOptions options_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::pair<Wish, std::function<void(Result)>>> wishes_;
  std::jthread thread_;
};

}  // namespace tetwarp::apps
