// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

namespace tetwarp::cuda_detail {

/// Threads of a block, where a kernel does not say otherwise.
constexpr int kThreads = 128;

/// How many blocks have `count` threads, the last block perhaps more.
/// @param threads  of a block
inline unsigned blocks_for(std::int64_t count, int threads = kThreads) {
  return static_cast<unsigned>((count + threads - 1) / threads);
}

/// Number of this thread among all that are launched, where blocks are in a row and have kThreads each.
__device__ inline std::int64_t thread_of_grid() { return std::int64_t{blockIdx.x} * kThreads + threadIdx.x; }
/// Number of its warp.
__device__ inline std::int64_t warp_of_grid() { return thread_of_grid() / 32; }

}  // namespace tetwarp::cuda_detail
