// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/arena.h"

#include <tbb/info.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace tetwarp::cpu {

namespace {

/// Arenas that nobody uses, by their number of threads. It is never destroyed: threads may end after statics do.
struct Idle {
  std::mutex mutex;
  std::map<int, std::vector<std::unique_ptr<tbb::task_arena>>> arenas;
};

Idle& idle() {
  static auto& all = *new Idle;
  return all;
}

int threads_of(const Limits& limits) {
  require(limits.threads >= 0, "threads is " + std::to_string(limits.threads) + ", expected 0 (all) or more");
  const int most = tbb::info::default_concurrency();
  return limits.threads > 0 ? std::min(limits.threads, most) : most;
}

}  // namespace

Arena::Arena(const Limits& limits) : threads_(threads_of(limits)) {
  {
    const std::lock_guard lock(idle().mutex);
    auto& arenas = idle().arenas[threads_];
    if (!arenas.empty()) {
      arena_ = std::move(arenas.back());
      arenas.pop_back();
    }
  }
  if (!arena_) arena_ = std::make_unique<tbb::task_arena>(threads_);
}

Arena::~Arena() {
  const std::lock_guard lock(idle().mutex);
  idle().arenas[threads_].push_back(std::move(arena_));
}

}  // namespace tetwarp::cpu
