// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cooperative_groups.h>

#include "cuda/runtime/launch.cuh"
#include "cuda/runtime/warp.cuh"
#include "deform/simulate/spring_solver.h"

/// The kernels of mass-spring. For mass_spring.cu alone.
namespace tetwarp::simulate {

namespace {

/// Threads of a block: one a node whose sum is made with it.
constexpr int kBlock = kSumBlock;
constexpr int kCrewPerProcessor = 4;  ///< blocks of `solve_kernel`

/// Calls a sweep for every node; a thread a node.
///
/// @param sweep  `sweep(n)` writes what belongs to node n
template <class Sweep>
__global__ void each_kernel(Sweep sweep, std::size_t nodes) {
  const std::size_t n = std::size_t{blockIdx.x} * kBlock + threadIdx.x;
  if (n < nodes) sweep(n);
}

/// Adds up the sums of all blocks, in the order that kSumBlock states, by the threads of one block.
/// @param terms  see `sum_of_block`
/// @return the total, in the first thread
template <class T>
__device__ T sum_of_blocks(const T* of_block, unsigned blocks, T (&terms)[kBlock]) {
  T own{};
  for (unsigned block = threadIdx.x; block < blocks; block += kBlock) own.add(of_block[block]);
  return cuda_detail::sum_of_block(own, terms);
}

/// Adds up what a sweep gives for every node, a thread a node, in the order that kSumBlock states. The block that
/// arrives last adds up what all left.
///
/// @param sweep     `sweep(n)` gives what is added for node n  @param then  `then(sum)` is called by one thread
/// @param of_block  room for the sum of each block: written, and read by the last block
/// @param arrived   how many blocks have arrived: 0 before and after
template <class T, class Sweep, class Then>
__global__ void sum_kernel(Sweep sweep, Then then, std::size_t nodes, T* of_block, unsigned* arrived) {
  const std::size_t n = std::size_t{blockIdx.x} * kBlock + threadIdx.x;
  __shared__ T terms[kBlock];
  __shared__ bool is_last;
  const T sum = cuda_detail::sum_of_block(n < nodes ? sweep(n) : T{}, terms);
  if (threadIdx.x == 0) {
    of_block[blockIdx.x] = sum;
    __threadfence();
    is_last = atomicAdd(arrived, 1u) == gridDim.x - 1;
  }
  __syncthreads();
  if (!is_last) return;
  __threadfence();
  const T total = sum_of_blocks(of_block, gridDim.x, terms);
  if (threadIdx.x == 0) {
    *arrived = 0;
    then(total);
  }
}

/// Shared memory for the terms of sums of a block.
struct alignas(16) TermRoom {
  std::byte bytes[kBlock * sizeof(Sums)];

  /// Sums of T for which there is room side by side.
  template <class T>
  static constexpr int sums() {
    return static_cast<int>(sizeof(Sums) / sizeof(T));
  }
  template <class T>
  __device__ auto terms(int number) -> T (&)[kBlock] {
    static_assert(sums<T>() > 0);
    return reinterpret_cast<T(*)[kBlock]>(bytes)[number];
  }
};

/// A launch whose blocks all run at the same time, each with a state of conjugate gradients of its own: as all make the
/// same totals of what all left, a sum costs one wait for all.
class SpringCrew {
 public:
  /// @param products  room for those of each block of nodes  @param sums  the same
  __device__ SpringCrew(const SpringArrays& a, GradientState& state, TermRoom& room, Products* products, Sums* sums)
      : a_(a), state_(state), room_(room), products_(products), sums_(sums) {}

  /// See `solve_part`.
  __device__ void set_up(const SolveTask& task) {
    each([&](std::size_t n) {
      if (task.follows) sweeps::PlacedMotion::at(a_, n);
      sweeps::Matrices::at(a_, task.kind, n);
    });
    wait();
    each([&](std::size_t n) {
      sweeps::Inverses::at(a_, task.kind, n);
      if (task.follows) {
        sweeps::PlacedForces::at(a_, task.kind, n);
      } else {
        sweeps::Forces::at(a_, n);
      }
      sweeps::Begin::at(a_, n);
    });
    by_first([&] { state_ = {.effort = task.effort}; });
    wait();
  }

  __device__ void iterate(Stiffness kind, int times) {
    for (int n = 0; n < times && !state_.is_done; ++n) {
      const Products sums = total([&](std::size_t node) { return sweeps::Bend::at(a_, kind, node); }, products_);
      by_first([&] { sweeps::AfterBend{&state_}(sums); });
      if (!state_.descends) return;
      each([&, share = state_.share, length = state_.length](std::size_t node) {
        sweeps::Descend::at(a_, share, length, node);
      });
      wait();
    }
  }

  __device__ void conclude(bool follows) {
    if (follows) {
      each([&](std::size_t n) { sweeps::Follow::at(a_, n); });
    } else {
      each([&](std::size_t n) { sweeps::Go::at(a_, 1, n); });
    }
    wait();
    const Sums there = total([&](std::size_t n) { return sweeps::StrainOf::at(a_, n); }, sums_);
    by_first([&] { state_.there = there; });
  }

 private:
  static __device__ void wait() { cooperative_groups::this_grid().sync(); }
  /// Has the first thread of each block change its state.
  template <class Work>
  static __device__ void by_first(const Work& work) {
    if (threadIdx.x == 0) work();
    __syncthreads();
  }
  template <class Work>
  __device__ void each(const Work& work) const {
    for (unsigned block = blockIdx.x; block < blocks_; block += gridDim.x) {
      const std::size_t n = std::size_t{block} * kBlock + threadIdx.x;
      if (n < a_.nodes) work(n);
    }
  }
  /// @return what `sum_kernel` gives, in the first thread of each block
  template <class T, class Sweep>
  __device__ T total(const Sweep& sweep, T* of_block) const {
    // When the block has arrived with the terms of another sum, all of it is done with the ones before.
    constexpr bool is_roomy = TermRoom::sums<T>() >= 2;
    int number = 0;
    for (unsigned block = blockIdx.x; block < blocks_; block += gridDim.x, number ^= 1) {
      const std::size_t n = std::size_t{block} * kBlock + threadIdx.x;
      const T own = n < a_.nodes ? sweep(n) : T{};
      if constexpr (!is_roomy) __syncthreads();
      const T sum = cuda_detail::sum_of_block(own, room_.template terms<T>(is_roomy ? number : 0));
      if (threadIdx.x == 0) of_block[block] = sum;
    }
    wait();
    return sum_of_blocks(of_block, blocks_, room_.template terms<T>(0));
  }

  const SpringArrays& a_;
  GradientState& state_;
  TermRoom& room_;
  Products* products_;
  Sums* sums_;
  const unsigned blocks_ = static_cast<unsigned>((a_.nodes + kBlock - 1) / kBlock);
};

/// What `solve_part` does, in one cooperative launch.
///
/// @param a         `state` is read, and written at the end
/// @param products  see SpringCrew
__global__ void __launch_bounds__(kBlock, kCrewPerProcessor)
    solve_kernel(const __grid_constant__ SpringArrays a, const __grid_constant__ SolveTask task, Products* products,
                 Sums* sums) {
  __shared__ GradientState state;
  __shared__ TermRoom room;
  SpringCrew crew(a, state, room, products, sums);
  if (task.resumes) {
    if (threadIdx.x == 0) state = *a.state;
    __syncthreads();
  } else {
    crew.set_up(task);
  }
  crew.iterate(task.kind, task.times);
  if (state.is_done || task.ends) crew.conclude(task.follows);
  if (blockIdx.x == 0 && threadIdx.x == 0) *a.state = state;
}

}  // namespace

}  // namespace tetwarp::simulate
