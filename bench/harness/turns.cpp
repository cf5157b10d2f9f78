// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/turns.h"

#include <sys/resource.h>

#include <chrono>

#include "bench/harness/markdown.h"

namespace tetwarp::bench {

std::function<std::any()> nothing(std::function<void()> run) {
  return [run = std::move(run)] {
    run();
    return std::any();
  };
}

void Turns::add(std::string step, std::string by, std::function<std::any()> run, std::function<void()> after) {
  contenders_.push_back({std::move(step), std::move(by), std::move(run), std::move(after)});
}

namespace {

double milliseconds(const timeval& time) {
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
}

}  // namespace

double cpu_ms() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    sum += milliseconds(usage.ru_utime) + milliseconds(usage.ru_stime);
  }
  return sum;
}

std::vector<IoTime> Turns::run(int repeats, const std::function<void(const std::string&)>& say) const {
  using Clock = std::chrono::steady_clock;
  std::vector<std::vector<double>> ms(contenders_.size()), cpu(contenders_.size());
  for (int repeat = 1; repeat <= repeats; ++repeat) {
    for (std::size_t n = 0; n < contenders_.size(); ++n) {
      const Contender& one = contenders_[n];
      const double cpu_before = cpu_ms();
      const auto start = Clock::now();
      std::any result = one.run();
      ms[n].push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
      cpu[n].push_back(cpu_ms() - cpu_before);
      result.reset();
      if (one.after) one.after();
      say(format("%d/%d  %-32s %-16s %8.1f ms, CPU %8.1f", repeat, repeats, one.step.c_str(), one.by.c_str(),
                 ms[n].back(), cpu[n].back()));
    }
  }
  std::vector<IoTime> times;
  for (std::size_t n = 0; n < contenders_.size(); ++n)
    times.push_back({contenders_[n].step, contenders_[n].by, summarize(ms[n]), summarize(cpu[n])});
  return times;
}

}  // namespace tetwarp::bench
