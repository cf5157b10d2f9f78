// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/usage.h"

#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <thread>

namespace tetwarp::apps {

namespace {

using nlohmann::json;

constexpr double kBusy = 0.8;  ///< a part that is busy for this share of the time holds up the others
/// A timing: how long a case held its device, in one stage or several.
constexpr const char* kOnDevice = "on_device";
/// Share of the time of all jobs that is spent waiting for memory, from which memory is named.
constexpr double kWaiting = 0.25;

double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::string percent(double share) {
  char text[16];
  std::snprintf(text, sizeof text, "%.0f %%", 100 * share);
  return text;
}

}  // namespace

Usage::Usage(std::size_t places, std::size_t devices, bool cuda, std::size_t jobs)
    : places_(places), devices_(devices), jobs_(jobs), cuda_(cuda), processor_before_(processor_seconds()) {}

void Usage::add(const json& timing) {
  const std::lock_guard lock(mutex_);
  for (const auto& [stage, seconds] : timing.items()) {
    if (seconds.is_number_float()) seconds_[stage] += seconds.get<double>();
  }
}

double Usage::wall() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

double Usage::processor_share() const {
  const double cores = std::max(1u, std::thread::hardware_concurrency());
  return (processor_seconds() - processor_before_) / (cores * wall());
}

json Usage::report() const {
  const std::lock_guard lock(mutex_);
  json document = {{"wall_seconds", wall()}, {"jobs", jobs_}, {"processor", processor_share()}};
  for (const auto& [stage, seconds] : seconds_) {
    if (stage != kOnDevice) document["stages"][stage] = seconds / (static_cast<double>(jobs_) * wall());
  }
  const auto on_device = seconds_.find(kOnDevice);
  if (cuda_ && on_device != seconds_.end())
    document["devices"] = on_device->second / (static_cast<double>(places_) * wall());
  return document;
}

std::string Usage::sentence() const {
  const json shares = report();
  const double processor = shares["processor"], devices = shares.value("devices", 0.0);
  const json stages = shares.value("stages", json::object());
  if (!stages.contains("resample")) return "";
  const double memory = stages.value("wait_memory", 0.0);
  const char* what = "files: reading them, and waiting until they are on the disk";
  if (devices >= kBusy && devices >= processor)
    what = devices_ > 1 ? "the CUDA devices" : "the CUDA device";
  else if (processor >= kBusy)
    what = "the processor";
  else if (memory >= kWaiting)
    what = "memory: more cases at once would need more of it (--memory)";
  std::string text = std::string("bottleneck: ") + what + " (processor busy " + percent(processor);
  if (cuda_) text += ", CUDA " + percent(devices);
  for (const char* stage : {"read", "field", "resample", "write", "commit", "wait_memory", "wait_device"}) {
    if (stages.value(stage, 0.0) >= 0.005) text += std::string(", ") + stage + " " + percent(stages[stage]);
  }
  return text + " of the cases' time)";
}

}  // namespace tetwarp::apps
