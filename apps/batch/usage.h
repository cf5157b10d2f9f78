// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

namespace tetwarp::apps {

/// Adds up what a batch was busy with, for the sentence that says what held it up.
class Usage {
 public:
  /// @param places   number of cases that can resample at the same time on all devices
  /// @param devices  number of devices
  /// @param jobs     number of cases in work at the same time
  Usage(std::size_t places, std::size_t devices, bool cuda, std::size_t jobs);

  /// Adds the seconds of a case by stage, as timings.jsonl has them. Several threads may call it at a time.
  void add(const nlohmann::json& timing);
  /// Shares of the time so far for which the processor, the devices and each stage were busy.
  nlohmann::json report() const;
  /// A line for people: "bottleneck: the processor (busy 97 %, ...)"; empty before a case was resampled.
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
