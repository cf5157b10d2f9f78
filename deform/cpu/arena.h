// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <tbb/task_arena.h>

#include <memory>
#include <utility>

#include "deform/resampler.h"

namespace tetwarp::cpu {

/// Threads of oneTBB for one user at a time: no more than the limits allow.
///
/// oneTBB 2021 does not give back what it keeps of a `tbb::task_arena` in which more than one thread worked (7 kB, seen
/// with 2021.8), so a process that makes one for every call grows for ever. Arenas are lent instead: the destructor
/// gives the arena to the next that asks for as many threads. A process has as many as were in use at the same time.
class Arena {
 public:
  /// @throws InputError for a negative number of threads
  explicit Arena(const Limits& limits);
  /// Gives the arena to the next user.
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  /// Runs `work` in the arena and returns what it returns.
  template <class Work>
  decltype(auto) execute(Work&& work) {
    return arena_->execute(std::forward<Work>(work));
  }
  /// Most threads that work in the arena.
  int max_concurrency() const { return arena_->max_concurrency(); }

 private:
  int threads_;
  std::unique_ptr<tbb::task_arena> arena_;
};

}  // namespace tetwarp::cpu
