// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/resources.h"

#include <algorithm>
#include <fstream>

#include "apps/cli/console.h"
#include "deform/errors.h"

namespace tetwarp::apps {

MemoryBudget::Grant MemoryBudget::wait_for(std::uint64_t bytes, const std::stop_token& stop) {
  if (bytes > bytes_) {
    throw Error("about " + format_bytes(bytes) + " of memory are needed, the batch has " + format_bytes(bytes_) +
                "; give it more with --memory, or a larger cell-size to the case");
  }
  std::unique_lock lock(mutex_);
  const std::uint64_t ticket = next_++;
  const auto is_next = [&] {
    while (given_up_.erase(turn_) > 0) ++turn_;
    return turn_ == ticket && held_ + bytes <= bytes_;
  };
  if (!changed_.wait(lock, stop, is_next)) {
    given_up_.insert(ticket);
    changed_.notify_all();
    throw Cancelled();
  }
  ++turn_;
  held_ += bytes;
  changed_.notify_all();
  return {*this, bytes};
}

MemoryBudget::Grant::~Grant() {
  const std::lock_guard lock(of_->mutex_);
  of_->held_ -= bytes_;
  of_->changed_.notify_all();
}

Devices::Devices(BackendChoice wanted, int cuda) : wanted_(wanted), cuda_(may_use_device(wanted) ? cuda : 0) {
  free_.assign(static_cast<std::size_t>(cuda_), kPlaces);
  count_ = std::max<std::size_t>(1, free_.size());
}

bool Devices::is_cuda(BackendChoice wanted) const {
  const BackendChoice of_case = meant_by(wanted);
  return demands_device(of_case) || (leaves_open(of_case) && is_any_left());
}

Devices::Lease Devices::wait_for(BackendChoice wanted, Share share, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const bool alone = share == Share::alone && is_cuda(wanted);
  const int places = alone ? kPlaces : 1;
  const auto freest = [&] { return std::max_element(free_.begin(), free_.end()); };
  const auto can_go_on = [&] {
    if (!is_cuda(wanted)) return cpu_is_free_;
    return !is_any_left() || (*freest() >= places && (alone || waiting_alone_ == 0));
  };
  waiting_alone_ += alone;
  const bool goes_on = changed_.wait(lock, stop, can_go_on);
  waiting_alone_ -= alone;
  if (alone) changed_.notify_all();
  if (!goes_on) throw Cancelled();
  if (!is_cuda(wanted)) {
    cpu_is_free_ = false;
    return {*this, {BackendChoice::cpu, 0}, 0};
  }
  if (!is_any_left())
    throw DeviceError("no CUDA device is left for the case; use --backend auto, the bits are the same");
  const auto device = freest();
  *device -= places;
  return {*this, {BackendChoice::cuda, static_cast<int>(device - free_.begin())}, places};
}

void Devices::lose(int device) {
  const std::lock_guard lock(mutex_);
  lost_.insert(device);
  free_[static_cast<std::size_t>(device)] = 0;
  changed_.notify_all();
}

void Devices::give_back(const Worker& worker, int places) {
  const std::lock_guard lock(mutex_);
  if (!may_use_device(worker.backend))
    cpu_is_free_ = true;
  else if (!lost_.contains(worker.device))
    free_[static_cast<std::size_t>(worker.device)] += places;
  changed_.notify_all();
}

Devices::Lease::~Lease() { of_->give_back(worker_, places_); }

namespace {

/// The number in a file that holds one, or in the line that begins with `key`; 0 where there is none.
std::uint64_t number_in(const char* path, const std::string& key = "") {
  std::ifstream file(path);
  std::string word;
  std::uint64_t number = 0;
  if (key.empty()) {
    file >> number;
    return file ? number : 0;
  }
  while (file >> word) {
    if (word == key && file >> number) return number;
  }
  return 0;
}

}  // namespace

std::uint64_t available_memory_bytes() {
  std::uint64_t bytes = number_in("/proc/meminfo", "MemAvailable:") * 1024;
  const std::uint64_t limit = number_in("/sys/fs/cgroup/memory.max"), used = number_in("/sys/fs/cgroup/memory.current");
  if (limit > 0) bytes = std::min(bytes, limit - std::min(limit, used));
  return bytes;
}

}  // namespace tetwarp::apps
