#include "apps/batch/resources.h"

#include <algorithm>
#include <fstream>

#include "apps/console.h"
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

Devices::Devices(const std::string& wanted, int cuda) : wanted_(wanted), cuda_(wanted == "cpu" ? 0 : cuda) {
  for (int device = 0; device < cuda_; ++device) free_.insert(device);
  count_ = std::max<std::size_t>(1, free_.size());
}

bool Devices::is_cuda(const std::string& wanted) const {
  const std::string& of_case = wanted == "auto" ? wanted_ : wanted;
  return of_case == "cuda" || (of_case == "auto" && cuda_ > static_cast<int>(lost_.size()));
}

Devices::Lease Devices::wait_for(const std::string& wanted, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto can_go_on = [&] {
    if (!is_cuda(wanted)) return cpu_is_free_;
    return !free_.empty() || static_cast<int>(lost_.size()) >= cuda_;
  };
  if (!changed_.wait(lock, stop, can_go_on)) throw Cancelled();
  if (!is_cuda(wanted)) {
    cpu_is_free_ = false;
    return {*this, {"cpu", 0}};
  }
  if (free_.empty())
    throw DeviceError("no CUDA device is left for the case; use --backend auto, the bits are the same");
  const int device = *free_.begin();
  free_.erase(free_.begin());
  return {*this, {"cuda", device}};
}

void Devices::lose(int device) {
  const std::lock_guard lock(mutex_);
  lost_.insert(device);
  free_.erase(device);
  changed_.notify_all();
}

void Devices::give_back(const Worker& worker) {
  const std::lock_guard lock(mutex_);
  if (worker.backend == "cpu")
    cpu_is_free_ = true;
  else if (!lost_.contains(worker.device))
    free_.insert(worker.device);
  changed_.notify_all();
}

Devices::Lease::~Lease() { of_->give_back(worker_); }

namespace {

/// The number in a file of one, or of the line that begins with `key`; 0 where there is none.
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
