// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/parallel_for.h>

#include <algorithm>
#include <span>
#include <tuple>
#include <vector>

#include "deform/cpu/arena.h"
#include "deform/simulate/host_machine.h"
#include "deform/simulate/spring_engine.h"
#include "deform/simulate/spring_grid.h"

namespace tetwarp::simulate {

namespace {

/// Sweeps over nodes on threads of the CPU, with vectors where SpringGrid has a sweep for them. See SpringSolver.
class CpuMachine : public HostMachine<SpringGrid::kLanes> {
 public:
  static constexpr bool kReadsLinks = false;

  CpuMachine(const Model& model, Limits limits)
      : grid_(model), arena_(limits), blocks_((model.nodes() + kSumBlock - 1) / kSumBlock) {}

  std::size_t padding() const { return grid_.padding; }

  template <class Sweep>
  void each(std::size_t, const Sweep& work) {
    for_blocks([&](std::size_t block) {
      const NodeRange range = range_of(block);
      if constexpr (requires { sweep(grid_, range, work); }) {
        sweep(grid_, range, work);
      } else {
        for (std::size_t n = range.begin; n < range.end; ++n) work(n);
      }
    });
  }

  template <class T, class Sweep, class Then>
  void sum(std::size_t, const Sweep& work, const Then& then) {
    std::vector<T>& of_block = std::get<std::vector<T>>(sums_);
    of_block.resize(blocks_);
    for_blocks([&](std::size_t block) {
      const NodeRange range = range_of(block);
      T terms[kSumBlock];
      if constexpr (requires { sweep(grid_, range, work, terms); }) {
        sweep(grid_, range, work, terms);
      } else {
        for (std::size_t n = range.begin; n < range.end; ++n) terms[n - range.begin] = work(n);
      }
      of_block[block] = tree_sum(terms);
    });
    then(sum_of_blocks(std::span<const T>(of_block)));
  }

  void solve(const SpringArrays& arrays, const SolveTask& task) {
    arena_.execute([&] { solve_part(*this, arrays, task); });
  }

 private:
  NodeRange range_of(std::size_t block) const {
    return {block * kSumBlock, std::min((block + 1) * kSumBlock, grid_.nodes)};
  }
  template <class Work>
  void for_blocks(const Work& work) {
    // A thread sweeps over neighbouring blocks: what it has read for one is in its cache for the next.
    arena_.execute([&] { tbb::parallel_for(std::size_t{0}, blocks_, work, tbb::static_partitioner()); });
  }

  SpringGrid grid_;
  cpu::Arena arena_;
  std::size_t blocks_;
  std::tuple<std::vector<Products>, std::vector<Sums>, std::vector<Ways>> sums_;
};

}  // namespace

std::unique_ptr<SpringEngine> make_cpu_springs(const Model& model, Limits limits) {
  return std::make_unique<SpringSolver<CpuMachine>>(model, model, limits);
}

}  // namespace tetwarp::simulate
