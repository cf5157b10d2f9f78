// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <cub/warp/warp_reduce.cuh>
#include <cub/warp/warp_scan.cuh>
#if CUB_VERSION >= 200800
#include <cuda/functional>
#endif

#include "cuda/runtime/bits.cuh"

/// What the threads of a warp, or of a block, find together: sums, least and largest values, ranks in a list.
///
/// Where a function asks for whole warps, all 32 lanes call it together. CUB does what costs no more with it. What is
/// written out here was measured against CUB with nvcc 13.0 for sm_90, each in a kernel that does nothing else:
///
///     | of a warp, or of a block of 256   | CUB: instructions, registers | written out | taken |
///     | sum of unsigned, least of int     | 20, 8 (one REDUX)            | 28, 12      | CUB   |
///     | inclusive scan of int             | 21, 16                       | 31, 12      | CUB   |
///     | least of float                    | 33, 12                       | 22, 12      | ours  |
///     | largest of unsigned long long     | 48, 16                       | 42, 16      | ours  |
///     | ranks of those threads that vote  | 67, 21 (BlockScan)           | 57, 19      | ours  |
///
/// With the scan of CUB number_kernel has 14 registers; it had 16.
///
/// Sums of floats are in an order that is written out: another one would give other bits.
namespace tetwarp::cuda_detail {

constexpr unsigned kAllLanes = ~0u;  ///< mask of a whole warp

/// Number of this thread in its warp, where a block's warps lie along x.
__device__ inline int lane_of_warp() { return static_cast<int>(threadIdx.x & 31); }

// The operations that CUB knows an instruction for; toolkits before 12.9 have them under CUB's own names.
#if CUB_VERSION >= 200800
using LeastOf = cuda::minimum<>;
using LargestOf = cuda::maximum<>;
#else
using LeastOf = cub::Min;
using LargestOf = cub::Max;
#endif

/// Sum over a whole warp. @return in lane 0
__device__ inline unsigned warp_sum(unsigned value) {
  cub::WarpReduce<unsigned>::TempStorage nothing;  // of a whole warp: values stay in registers
  return cub::WarpReduce<unsigned>(nothing).Sum(value);
}
/// The least of a whole warp. @return in lane 0
__device__ inline int warp_min(int value) {
  cub::WarpReduce<int>::TempStorage nothing;
  return cub::WarpReduce<int>(nothing).Reduce(value, LeastOf{});
}
/// The largest of a whole warp. @return in lane 0
__device__ inline int warp_max(int value) {
  cub::WarpReduce<int>::TempStorage nothing;
  return cub::WarpReduce<int>(nothing).Reduce(value, LargestOf{});
}

/// The least of a whole warp that is a number, as `fminf` has it. @return in every lane
__device__ inline float warp_min(float value) {
  for (int step = 16; step > 0; step /= 2) value = fminf(value, __shfl_xor_sync(kAllLanes, value, step));
  return value;
}
/// The largest of a whole warp that is a number, as `fmaxf` has it. @return in every lane
__device__ inline float warp_max(float value) {
  for (int step = 16; step > 0; step /= 2) value = fmaxf(value, __shfl_xor_sync(kAllLanes, value, step));
  return value;
}
/// The largest of a whole warp. @return in every lane
__device__ inline unsigned long long warp_max(unsigned long long value) {
  for (int step = 16; step > 0; step /= 2) value = max(value, __shfl_xor_sync(kAllLanes, value, step));
  return value;
}

/// Sum over the lanes of a whole warp up to and including this one.
__device__ inline int warp_scan(int value) {
  typename cub::WarpScan<int>::TempStorage nothing;
  int sum = 0;
  cub::WarpScan<int>(nothing).InclusiveSum(value, sum);
  return sum;
}

/// Sum over groups of `lanes` neighbouring lanes, returned in every lane. CUB wants the size of groups when compiled.
/// @param lanes  a power of two, the same in the whole warp
__device__ inline unsigned group_sum(unsigned value, int lanes) {
  for (int step = lanes / 2; step > 0; step /= 2) value += __shfl_xor_sync(kAllLanes, value, step);
  return value;
}
/// Sum over the lanes of a group of `lanes` lanes up to and including this one, as `group_sum`.
__device__ inline int group_scan(int value, int lanes) {
  const int lane = static_cast<int>(threadIdx.x) & (lanes - 1);
  for (int step = 1; step < lanes; step *= 2) {
    const int below = __shfl_up_sync(kAllLanes, value, step, lanes);
    if (lane >= step) value += below;
  }
  return value;
}

/// Adds the sum of a whole warp to a counter: one atomic operation a warp, and none where the sum is 0.
__device__ inline void warp_add(unsigned long long* counter, unsigned value) {
  const unsigned sum = warp_sum(value);
  if (lane_of_warp() == 0 && sum != 0) atomicAdd(counter, static_cast<unsigned long long>(sum));
}
/// Adds 1 for every thread of the warp whose condition holds; for the threads that have come here, not whole warps.
__device__ inline void warp_count(unsigned long long* counter, bool condition) {
  const unsigned active = __activemask();
  const unsigned votes = __ballot_sync(active, condition);
  if (votes != 0 && lane_of_warp() == first_bit(active))
    atomicAdd(counter, static_cast<unsigned long long>(__popc(votes)));
}

/// Among the lanes that voted, how many come before this one: its place where the voters' things are listed.
__device__ inline int rank_among(unsigned votes, int lane) { return __popc(votes & bits_below(lane)); }

/// Lists what threads of a block have, in the order of the threads, one round after another. All threads call it; what
/// `per_warp` held may be overwritten in the next round once the block has synchronised.
///
///     votes of warp 0   warp 1   ...     places: those of warp 0 in the order of its lanes, then those of warp 1, ...
///     __popc -> per_warp[0]   [1]   ...
///
/// @param has         whether this thread has something  @param lane, warp  of this thread
/// @param per_warp  in shared memory, a word for each warp of the block
/// @param listed    how many there were before this round, and then after it; the same in all threads
/// @return the place of what this thread has
template <int kWarps>
__device__ unsigned rank_in_block(bool has, int lane, int warp, unsigned (&per_warp)[kWarps], unsigned& listed) {
  const unsigned votes = __ballot_sync(kAllLanes, has);
  if (lane == 0) per_warp[warp] = static_cast<unsigned>(__popc(votes));
  __syncthreads();
  unsigned place = listed + static_cast<unsigned>(rank_among(votes, lane));
  for (int w = 0; w < kWarps; ++w) {
    if (w < warp) place += per_warp[w];
    listed += per_warp[w];
  }
  return place;
}

/// What another lane holds, which is so many lanes further.
template <class T>
__device__ T from_lane_above(const T& own, int lanes) {
  static_assert(sizeof(T) % sizeof(unsigned) == 0);
  union Words {
    __device__ Words() {}
    T value;
    unsigned words[sizeof(T) / sizeof(unsigned)];
  } all;
  all.value = own;
#pragma unroll
  for (unsigned& word : all.words) word = __shfl_down_sync(kAllLanes, word, static_cast<unsigned>(lanes));
  return all.value;
}

/// Term t after upper halves were added to lower halves, until kHalf terms are left of kThreads.
template <int kHalf, int kThreads, class T>
__device__ T after_halving(const T* terms, int t) {
  if constexpr (kHalf == kThreads) {
    return terms[t];
  } else {
    T sum = after_halving<2 * kHalf, kThreads>(terms, t);
    sum.add(after_halving<2 * kHalf, kThreads>(terms, t + kHalf));
    return sum;
  }
}

/// Adds up what the threads of a block hold, as a tree that never changes, so that the sum's bits do not either: the
/// upper half of the terms is added to the lower one, until one is left. `cub::BlockReduce` adds in an order of its
/// own. The block waits once; all but the first warp may go on then.
///
/// @tparam T         has `add(const T&)`
/// @tparam kThreads  of a block, a power of two, 32 or more
/// @param terms      shared memory that no thread uses any more: written
/// @return the sum, in the first thread
template <int kThreads, class T>
__device__ T sum_of_block(const T& own, T (&terms)[kThreads]) {
  terms[threadIdx.x] = own;
  __syncthreads();
  if (threadIdx.x >= 32) return {};
  T sum = after_halving<32, kThreads>(terms, static_cast<int>(threadIdx.x));
#pragma unroll
  for (int half = 16; half > 0; half /= 2) sum.add(from_lane_above(sum, half));
  return sum;
}

/// Transposes 32 x 32 bits, a word a lane: bit n of lane m from bit m of lane n. Each step swaps squares of half the
/// size: 16 x 16 off the diagonal, then 8 x 8 within each, and so on. For whole warps.
__device__ inline std::uint32_t transposed(std::uint32_t bits, int lane) {
  std::uint32_t mask = 0x0000FFFF;
#pragma unroll
  for (int step = 16; step > 0; step /= 2, mask ^= mask << step) {
    const std::uint32_t other = __shfl_xor_sync(kAllLanes, bits, step);
    bits = (lane & step) != 0 ? (bits & ~mask) | (other >> step & mask) : (bits & mask) | (other << step & ~mask);
  }
  return bits;
}

}  // namespace tetwarp::cuda_detail
