// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <vector>

#include "deform/simulate/host_machine.h"
#include "deform/simulate/spring_solver.h"

namespace tetwarp::test {

/// Runs the sweeps of SpringSolver one node after the other, as CUDA's threads do, with nothing but the sweeps' own
/// code: what the CPU computes with vectors, and what CUDA computes, must have its bits.
class PlainMachine : public simulate::HostMachine<0> {
 public:
  static constexpr bool kReadsLinks = true;

  std::size_t padding() const { return 0; }

  template <class Sweep>
  void each(std::size_t nodes, const Sweep& sweep) const {
    for (std::size_t n = 0; n < nodes; ++n) sweep(n);
  }
  template <class T, class Sweep, class Then>
  void sum(std::size_t nodes, const Sweep& sweep, const Then& then) const {
    std::vector<T> of_block;
    for (std::size_t begin = 0; begin < nodes; begin += kThreads) {
      std::vector<T> of_thread(kThreads);
      for (std::size_t t = 0; t < std::min(kThreads, nodes - begin); ++t) of_thread[t] = sweep(begin + t);
      of_block.push_back(tree(of_thread));
    }
    std::vector<T> of_thread(kThreads);
    for (std::size_t block = 0; block < of_block.size(); ++block) of_thread[block % kThreads].add(of_block[block]);
    then(tree(of_thread));
  }
  void solve(const simulate::SpringArrays& arrays, const simulate::SolveTask& task) const {
    solve_part(*this, arrays, task);
  }

 private:
  static constexpr std::size_t kThreads = simulate::kSumBlock;

  template <class T>
  static T tree(std::vector<T>& of_thread) {
    for (std::size_t half = kThreads / 2; half > 0; half /= 2) {
      for (std::size_t t = 0; t < half; ++t) of_thread[t].add(of_thread[t + half]);
    }
    return of_thread[0];
  }
};

}  // namespace tetwarp::test
