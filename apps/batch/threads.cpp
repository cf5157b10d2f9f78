// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/threads.h"

#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <system_error>
#include <thread>
#include <vector>

namespace tetwarp::apps {

namespace {

using namespace std::chrono_literals;

constexpr std::size_t kPerCase = 4;   ///< the case itself, the hash of its input, and flushing its files
constexpr std::size_t kOfCuda = 16;   ///< threads of the driver, and of copies from devices
constexpr auto kLongestStart = 50ms;  ///< the longest time that starting all threads of oneTBB may take

/// How many of `wanted` threads the system gives at the same time. All of them end again.
std::size_t threads_given(std::size_t wanted) {
  std::promise<void> end;
  const std::shared_future<void> ended = end.get_future().share();
  std::vector<std::jthread> threads;
  threads.reserve(wanted);
  try {
    while (threads.size() < wanted) threads.emplace_back([ended] { ended.wait(); });
  } catch (const std::system_error&) {  // the system gives no more
  }
  end.set_value();
  return threads.size();
}

void start_workers(std::size_t count) {
  std::atomic<std::size_t> started = 0;
  const auto latest = std::chrono::steady_clock::now() + kLongestStart;
  const auto wait_for_all = [&](std::size_t) {
    ++started;
    while (started < count && std::chrono::steady_clock::now() < latest) std::this_thread::yield();
  };
  tbb::parallel_for(std::size_t{0}, count, wait_for_all, tbb::simple_partitioner());
}

}  // namespace

Threads::Threads(std::size_t jobs) : jobs_(jobs) {
  std::size_t workers = static_cast<std::size_t>(tbb::info::default_concurrency());
  const std::size_t wanted = kPerCase * jobs + workers + kOfCuda, given = threads_given(wanted);
  if (given < wanted) {
    limit_ = given;
    workers = std::clamp<std::size_t>(given / 3, 1, workers);
    jobs_ = std::clamp<std::size_t>(given / 6, 1, jobs);
    fewer_workers_.emplace(tbb::global_control::max_allowed_parallelism, workers);
  }
  start_workers(workers);
}

}  // namespace tetwarp::apps
