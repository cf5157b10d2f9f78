// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "cuda/lattice/float_snap.cuh"

namespace tetwarp::cuda_detail {

namespace {

/// Packs vertices; a thread a vertex. A thread block reads all that is its own before it writes, for the packed
/// vertices may lie over the displacements: vertex n has bytes 12 n to 12 n + 11 there, and 8 n to 8 n + 7 once it is
/// packed.
///
/// @param pass        `displacement` is read, `packed` written
/// @param begin, end  numbers of the vertices; those before `begin` are packed already
template <bool kExact>
__global__ void pack_kernel(const __grid_constant__ StepPass pass, FloatSnap fast, std::int64_t begin,
                            std::int64_t end) {
  const std::int64_t n = begin + thread_of_grid();
  glm::vec3 raised(0);
  if (n < end) raised = raised_steps<kExact>(pass, fast, pass.displacement[n], static_cast<int>(n));
  __syncthreads();
  if (n < end) pass.packed[n] = pass.lattice.packing.pack(raised);
}

/// Least and most that vertices move on each axis; a thread a vertex, the last vertex again in threads beyond it.
///
/// @param low_high  least and most of i, j and k, 2^-12 voxel: widened once a warp, by atomics
__global__ void range_kernel(const __grid_constant__ StepPass pass, int* low_high) {
  const std::int64_t n = thread_of_grid();
  const glm::i64vec3 size = glm::i64vec3(pass.lattice.cells) + std::int64_t{1};
  const std::int64_t last = size.x * size.y * size.z - 1, at = n < last ? n : last;
  const glm::ivec3 moved = -snapped(pass.frame, pass.displacement[at], unravel(at, size), at, pass.found).u;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    const int low = warp_min(moved[axis]), high = warp_max(moved[axis]);
    if (lane_of_warp() != 0) continue;
    if (low < low_high[axis]) atomicMin(&low_high[axis], low);
    if (high > low_high[3 + axis]) atomicMax(&low_high[3 + axis], high);
  }
}

}  // namespace

void pack_in_place(const StepPass& pass, cudaStream_t stream) {
  const std::int64_t vertices = std::int64_t{pass.lattice.slice} * (pass.lattice.cells.z + 1);
  const FloatSnap fast(pass.frame, pass.lattice, pass.lattice.packing.lift());
  const auto kernel = fast.is_exact() ? pack_kernel<true> : pack_kernel<false>;
  for (std::int64_t begin = 0, end; begin < vertices; begin = end) {
    // Each piece is packed over displacements that were packed before; the first by one thread block.
    end = std::min(std::max(begin + begin / 2, std::int64_t{kThreads}), vertices);
    kernel<<<blocks_for(end - begin), kThreads, 0, stream>>>(pass, fast, begin, end);
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void find_range(const StepPass& pass, int* low_high, cudaStream_t stream) {
  const std::int64_t vertices = std::int64_t{pass.lattice.slice} * (pass.lattice.cells.z + 1);
  range_kernel<<<blocks_for(vertices), kThreads, 0, stream>>>(pass, low_high);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
