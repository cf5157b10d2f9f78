// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <any>
#include <functional>
#include <string>
#include <vector>

#include "bench/io/io_results.h"

namespace tetwarp::bench {

/// A run for Turns that leaves its result in files.
std::function<std::any()> nothing(std::function<void()> run);

/// CPU time of this process and of the programs that it has waited for, all threads.
double cpu_ms();

/// Programs that are timed in turn, so that what else the machine does falls on all of them alike.
class Turns {
 public:
  /// @param run    timed; what it returns is given back when the clock has stopped
  /// @param after  not timed: removes what `run` left behind
  void add(std::string step, std::string by, std::function<std::any()> run, std::function<void()> after = {});

  /// Each once in every repeat, in the order that they were added.
  /// @param say  is told of every repeat, one line
  std::vector<IoTime> run(int repeats, const std::function<void(const std::string&)>& say) const;

 private:
  struct Contender {
    std::string step, by;
    std::function<std::any()> run;
    std::function<void()> after;
  };
  std::vector<Contender> contenders_;
};

}  // namespace tetwarp::bench
