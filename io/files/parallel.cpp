// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/parallel.h"

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>

namespace tetwarp {
namespace {

/// Keeps the exception of the lowest index, so that it does not depend on threads which one is thrown.
class FirstFailure {
 public:
  bool is_before(std::size_t index) const { return lowest_.load() < index; }
  void record(std::size_t index, std::exception_ptr failure) {
    const std::lock_guard lock(mutex_);
    if (index >= lowest_.load()) return;
    lowest_ = index;
    failure_ = std::move(failure);
  }
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::mutex mutex_;
  std::atomic<std::size_t> lowest_{SIZE_MAX};
  std::exception_ptr failure_;
};

/// Calls Control::progress from one thread at a time, with rising numbers.
class ProgressCount {
 public:
  ProgressCount(const Control& control, std::size_t count) : control_(control), count_(count) {}
  void one_more() {
    if (!control_.progress) return;
    const std::lock_guard lock(mutex_);
    control_.progress(static_cast<double>(++done_) / static_cast<double>(count_));
  }

 private:
  const Control& control_;
  std::size_t count_, done_ = 0;
  std::mutex mutex_;
};

/// An arena of so many threads. It is kept: oneTBB 2021.8 loses 7 kB for each arena in which several threads worked.
tbb::task_arena& arena_of(int threads) {
  static std::mutex mutex;
  // Never destroyed, for oneTBB may end before static objects do.
  static auto& arenas = *new std::map<int, tbb::task_arena>;
  const std::lock_guard lock(mutex);
  return arenas.try_emplace(threads, threads).first->second;
}

}  // namespace

void for_each_index(std::size_t count, int threads, const Control& control,
                    const std::function<void(std::size_t)>& body) {
  FirstFailure failure;
  ProgressCount progress(control, count);
  const auto one = [&](std::size_t i) {
    if (control.stop.stop_requested() || failure.is_before(i)) return;
    try {
      body(i);
      progress.one_more();
    } catch (...) {
      failure.record(i, std::current_exception());
    }
  };
  const int usable = tbb::info::default_concurrency();  // a larger arena would make oneTBB print a warning
  arena_of(threads > 0 ? std::min(threads, usable) : usable).execute([&] {
    tbb::this_task_arena::isolate(  // keeps a thread that waits from taking up work of other calls
        [&] { tbb::parallel_for(std::size_t{0}, count, one, tbb::simple_partitioner()); });
  });
  failure.rethrow();
  if (control.stop.stop_requested()) throw Cancelled();
}

}  // namespace tetwarp
