// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/runner.h"

namespace tetwarp::apps {

namespace {

using namespace std::chrono_literals;
constexpr auto kPatience = 3500ms;  ///< a part of the 5 s within which an interrupted batch ends

}  // namespace

void Runner::work() {
  try {
    for (std::size_t n = next_++; n < cases_.size() && !interrupt_token().stop_requested(); n = next_++) {
      parts_.progress.started(cases_[n]->id);
      const CaseOutcome outcome = run_case(*cases_[n], parts_.resources, interrupt_token());
      parts_.usage.add(outcome.timing.document());
      parts_.results.add(outcome);
      parts_.progress.ended(outcome);
    }
  } catch (const Cancelled&) {
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = std::current_exception();
    next_ = cases_.size();
  }
  const std::lock_guard lock(mutex_);
  --working_;
  ended_.notify_all();
}

/// Starts threads that make cases. If the system gives fewer than there are jobs, these do all the work.
std::vector<std::jthread> Runner::start(std::size_t jobs) {
  std::vector<std::jthread> threads;
  threads.reserve(jobs);
  while (threads.size() < jobs) {
    const std::lock_guard lock(mutex_);
    try {
      threads.emplace_back([this] { work(); });
    } catch (const std::system_error& error) {
      if (threads.empty()) throw Error(std::string("the system gives the batch no thread: ") + error.what());
      break;
    }
    ++working_;
  }
  return threads;
}

bool Runner::run(std::size_t jobs, const std::function<void()>& abandon) {
  std::vector<std::jthread> threads = start(jobs);
  std::optional<std::chrono::steady_clock::time_point> asked;
  {
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, 100ms, [&] { return working_ == 0; })) {
      parts_.progress.draw();
      if (!interrupt_token().stop_requested()) continue;
      if (!asked) asked = std::chrono::steady_clock::now();
      if (std::chrono::steady_clock::now() - *asked > kPatience) abandon();
    }
  }
  threads.clear();
  if (failure_) std::rethrow_exception(failure_);
  return !interrupt_token().stop_requested();
}

}  // namespace tetwarp::apps
