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

/// Shared memory for the terms of a sum of a block.
struct alignas(16) TermRoom {
  std::byte bytes[kBlock * sizeof(Sums)];

  template <class T>
  __device__ auto terms() -> T (&)[kBlock] {
    static_assert(sizeof(T) <= sizeof(Sums));
    return *reinterpret_cast<T(*)[kBlock]>(bytes);
  }
};

/// A launch whose blocks all run at the same time, each with a state of conjugate gradients of its own: as all make the
/// same totals of what all left, a sum costs one wait for all.
class SpringCrew {
 public:
  /// @param of_block  room for the sum of each block of nodes  @param of_other  the same  @param sums  the same
  /// @param rooms     two of them
  __device__ SpringCrew(const SpringArrays& a, GradientState& state, TermRoom* rooms, Sum* of_block, Sum* of_other,
                        Sums* sums)
      : a_(a), state_(state), rooms_(rooms), of_block_(of_block), of_other_(of_other), sums_(sums) {}

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
    });
    if (task.follows) wait();  // p was read, and is written now
    const Sum rz = total([&](std::size_t n) { return sweeps::Begin::at(a_, n); }, of_other_);
    by_first([&] { sweeps::AfterBegin{&state_, task.effort}(rz); });
  }

  __device__ void iterate(Stiffness kind, int times) {
    for (int n = 0; n < times && !state_.is_done; ++n) {
      const Sum curvature = total([&](std::size_t node) { return sweeps::Bend::at(a_, kind, node); }, of_block_);
      by_first([&] { sweeps::AfterBend{&state_}(curvature); });
      if (state_.is_done) return;
      const Sum next = total(
          [&, length = state_.length](std::size_t node) { return sweeps::Descend::at(a_, length, node); }, of_other_);
      by_first([&] { sweeps::AfterDescend{&state_}(next); });
      if (state_.is_done) return;
      each([&, share = state_.share](std::size_t node) { sweeps::NextDirection::at(a_, share, node); });
      wait();
    }
  }

  __device__ void conclude(bool follows) {
    if (follows) {
      each([&](std::size_t n) { sweeps::Follow::at(a_, n); });
    } else {
      const Sums direction = total([&](std::size_t n) { return sweeps::SearchDirection::at(a_, n); }, sums_);
      by_first([&] { state_.direction = direction; });
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
    // When a block has arrived in the next room, all of it is done with the one before.
    int room = 0;
    for (unsigned block = blockIdx.x; block < blocks_; block += gridDim.x, room ^= 1) {
      const std::size_t n = std::size_t{block} * kBlock + threadIdx.x;
      const T sum = cuda_detail::sum_of_block(n < a_.nodes ? sweep(n) : T{}, rooms_[room].template terms<T>());
      if (threadIdx.x == 0) of_block[block] = sum;
    }
    wait();
    return sum_of_blocks(of_block, blocks_, rooms_[0].template terms<T>());
  }

  const SpringArrays& a_;
  GradientState& state_;
  TermRoom* rooms_;
  Sum *of_block_, *of_other_;
  Sums* sums_;
  const unsigned blocks_ = static_cast<unsigned>((a_.nodes + kBlock - 1) / kBlock);
};

/// What `solve_part` does, in one cooperative launch.
///
/// @param a         `state` is read, and written at the end
/// @param of_block  see SpringCrew
__global__ void __launch_bounds__(kBlock, kCrewPerProcessor)
    solve_kernel(const __grid_constant__ SpringArrays a, const __grid_constant__ SolveTask task, Sum* of_block,
                 Sum* of_other, Sums* sums) {
  __shared__ GradientState state;
  __shared__ TermRoom rooms[2];
  SpringCrew crew(a, state, rooms, of_block, of_other, sums);
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
