// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/cli/shared_input.h"
#include "apps/deform/deform_worker.h"

namespace tetwarp::apps {

/// Memory that all running cases share, granted in the order of requests, so that a large case is not overtaken for
/// ever.
class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t bytes) : bytes_(bytes) {}

  /// A part of the budget, until it dies.
  class Grant {
   public:
    Grant(MemoryBudget& of, std::uint64_t bytes) : of_(&of), bytes_(bytes) {}
    ~Grant();
    Grant(const Grant&) = delete;
    Grant& operator=(const Grant&) = delete;

   private:
    MemoryBudget* of_;
    std::uint64_t bytes_;
  };

  /// Waits until so many bytes are free.
  /// @throws Error for more than the whole budget
  /// @throws Cancelled when a stop is requested
  Grant wait_for(std::uint64_t bytes, const std::stop_token& stop);
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::uint64_t bytes_, held_ = 0, next_ = 0, turn_ = 0;
  std::set<std::uint64_t> given_up_;  ///< tickets of requests that were given up
  std::mutex mutex_;
  std::condition_variable_any changed_;
};

/// Places at which a case can resample: on every CUDA device that works, several cases at a time, or on the CPU, one
/// case at a time. Cases take any free place.
class Devices {
 public:
  /// Cases that share a CUDA device: while one computes there, others copy, and a simulation leaves room for more.
  static constexpr int kPlaces = 3;
  enum class Share { with_others, alone };

  /// @param wanted  of the batch
  /// @param cuda    number of CUDA devices
  Devices(BackendChoice wanted, int cuda);

  /// A place that a case holds until this object dies.
  class Lease {
   public:
    Lease(Devices& of, Worker worker, int places) : of_(&of), worker_(worker), places_(places) {}
    ~Lease();
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    const Worker& worker() const { return worker_; }

   private:
    Devices* of_;
    Worker worker_;
    int places_;
  };

  /// Waits for a free place.
  /// @param wanted  of the case; where it leaves open, that of the batch counts
  /// @param share   alone: a CUDA device without other cases; cases that come later wait meanwhile
  /// @throws DeviceError where CUDA is chosen and no device is left
  /// @throws Cancelled when a stop is requested
  Lease wait_for(BackendChoice wanted, Share share, const std::stop_token& stop);
  /// Whether the CPU may take a case that no CUDA device can.
  /// @param wanted  of the case
  bool may_fall_back(BackendChoice wanted) const { return leaves_open(meant_by(wanted)); }
  /// Withdraws a device that failed: no case gets it any more.
  void lose(int device);
  std::size_t count() const { return count_; }  ///< Number of devices at the start; the CPU counts as one
  /// The most cases that resample at the same time, on the devices at the start.
  std::size_t places() const { return cuda_ > 0 ? count_ * kPlaces : 1; }

 private:
  BackendChoice meant_by(BackendChoice wanted) const { return leaves_open(wanted) ? wanted_ : wanted; }
  bool is_cuda(BackendChoice wanted) const;
  bool is_any_left() const { return static_cast<int>(lost_.size()) < cuda_; }
  void give_back(const Worker& worker, int places);

  BackendChoice wanted_;
  std::vector<int> free_;  ///< by CUDA device: its free places
  std::set<int> lost_;
  int waiting_alone_ = 0;
  bool cpu_is_free_ = true;
  int cuda_;
  std::size_t count_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
};

/// What all cases in work share.
struct Resources {
  MemoryBudget& memory;
  Devices& devices;
  SharedInputs& inputs;
};

/// Bytes of memory that the system and the control group of this process can still give.
std::uint64_t available_memory_bytes();

}  // namespace tetwarp::apps
