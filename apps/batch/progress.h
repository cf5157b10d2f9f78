// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/batch/case_run.h"
#include "apps/cli/console.h"

namespace tetwarp::apps {

/// What a batch tells on standard error while it runs. A person at a terminal sees a bar with cases a minute and the
/// time left, and a line for each case that fails; a machine gets JSON Lines. Cases are named by their ids, and nothing
/// tells of patients.
class BatchProgress {
 public:
  enum class Form {
    none,    ///< nothing but what no file of the batch says either (--quiet)
    person,  ///< lines, and at a terminal a bar
    machine  ///< JSON Lines (--log-json)
  };

  explicit BatchProgress(Form form);
  /// Removes the bar.
  ~BatchProgress();
  BatchProgress(const BatchProgress&) = delete;
  BatchProgress& operator=(const BatchProgress&) = delete;

  /// Begins to tell of cases. @param cases  number of cases to run. @param finished  number that earlier runs finished
  void begin(std::size_t cases, std::size_t finished);
  /// Tells that a case was started. Several threads may call `started`, `ended` and `warn` at a time.
  void started(const std::string& id);
  /// Tells that a case was done, failed or was refused, with the reason.
  void ended(const CaseOutcome& outcome);
  /// Tells a warning about the batch, one line without "warning: ".
  void warn(const std::string& text);
  /// Tells of finished cases that are made again. @param reason  "the row has changed"
  void again(const std::string& reason, const std::vector<std::string>& ids);
  /// Draws the bar anew, for a person at a terminal after the first second. The runner calls it from time to time.
  void draw();
  /// Tells the end of the batch. @param summary  numbers of cases, for a machine
  void end(const nlohmann::json& summary);

 private:
  void print(const nlohmann::json& event);
  void print(const std::string& line);
  void clear();

  Form form_;
  std::size_t cases_ = 0, done_ = 0, failed_ = 0;
  bool terminal_, visible_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
};

}  // namespace tetwarp::apps
