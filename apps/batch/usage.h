// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

namespace tetwarp::apps {

/// What a batch was busy with: for the sentence that says what held it up.
class Usage {
 public:
  /// @param places  of cases that resample at once, on so many `devices`. @param jobs  cases in work at once
  Usage(std::size_t places, std::size_t devices, bool cuda, std::size_t jobs);

  /// Seconds of a case by stage, as in timings.jsonl. May be called by several threads.
  void add(const nlohmann::json& timing);
  /// Shares of the time so far: of processor, devices and each stage.
  nlohmann::json report() const;
  /// One line for people: "bottleneck: the processor (busy 97 %, ...)"; nothing before a case was resampled.
  std::string sentence() const;

 private:
  double wall() const;
  double processor_share() const;

  std::size_t places_, devices_, jobs_;
  bool cuda_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double processor_before_;
  std::map<std::string, double> seconds_;
  mutable std::mutex mutex_;
};

}  // namespace tetwarp::apps
