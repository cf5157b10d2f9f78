// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

namespace tetwarp::bench {

/// What every run gave, under the name that it has in a row: "ms", "set_field_ms", "peak_bytes".
using Samples = std::map<std::string, std::vector<double>>;

/// CPU time of this process and of the programs that it has waited for, all threads.
double cpu_ms();

/// Counts from when it is made.
class Stopwatch {
 public:
  double ms() const { return std::chrono::duration<double, std::milli>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// Who takes part in a measurement.
struct Contender {
  std::string name;
  std::function<void(Samples&)> run;                   ///< once; adds what it measured
  bool warms_up = true;                                ///< whether it runs before time is taken, too
  int most_repeats = std::numeric_limits<int>::max();  ///< of those that take minutes
};

/// A contender of which the whole run is timed, "ms" and "cpu_ms".
/// @param run    what it returns is given back when the clock has stopped
/// @param after  not timed: removes what `run` left behind
template <class Run>
Contender timed(std::string name, Run run, std::function<void()> after = {}) {
  const auto once = [run = std::move(run), after = std::move(after)](Samples& samples) {
    const double cpu_before = cpu_ms();
    const Stopwatch watch;
    const auto stop = [&] {
      samples["ms"].push_back(watch.ms());
      samples["cpu_ms"].push_back(cpu_ms() - cpu_before);
    };
    if constexpr (std::is_void_v<std::invoke_result_t<const Run&>>) {
      run();
      stop();
    } else {
      const auto result = run();
      stop();
    }
    if (after) after();
  };
  return {std::move(name), once};
}

/// Everybody once in every turn, in their order, so that what else the machine does falls on all of them alike.
/// @param warmup  turns of which nothing is kept  @param say  is told of every turn of every contender, one line
/// @return  one for each contender
std::vector<Samples> take_turns(const std::vector<Contender>& contenders, int warmup, int repeats,
                                const std::function<void(const std::string&)>& say = {});

}  // namespace tetwarp::bench
