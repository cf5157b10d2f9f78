// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/turns.h"

#include <sys/resource.h>

#include "bench/harness/results.h"

namespace tetwarp::bench {

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

std::vector<Samples> take_turns(const std::vector<Contender>& contenders, int warmup, int repeats,
                                const std::function<void(const std::string&)>& say) {
  std::vector<Samples> kept(contenders.size()), untimed(contenders.size());
  for (int turn = -warmup; turn < repeats; ++turn) {
    for (std::size_t n = 0; n < contenders.size(); ++n) {
      const Contender& one = contenders[n];
      if (turn < 0 ? !one.warms_up : turn >= one.most_repeats) continue;
      Samples& samples = (turn < 0 ? untimed : kept)[n];
      one.run(samples);
      if (!say || turn < 0) continue;
      std::string line = format("%d/%d  %-48s", turn + 1, repeats, one.name.c_str());
      for (const auto& [name, values] : samples) line += format("  %s %.1f", name.c_str(), values.back());
      say(line);
    }
  }
  return kept;
}

}  // namespace tetwarp::bench
