// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/tile_content.cuh"

#include <type_traits>

#include "cuda/lattice/lattice.cuh"
#include "cuda/runtime/launch.cuh"
#include "cuda/runtime/warp.cuh"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kAround = 2;  ///< voxels: one for linear samples, one for rounding errors of their places

/// The values around each undeformed cell; a warp a cell.
///
/// @param voxels  on the grid of the lattice's steps, i fastest  @param size  on each axis
/// @param hulls   see `find_content`
template <class V>
__global__ void content_of_cells_kernel(StepLattice lattice, const V* voxels, glm::ivec3 size, ValueHull* hulls) {
  const std::int64_t cell = thread_of_grid() / 32;
  if (cell >= std::int64_t{lattice.cells.x} * lattice.cells.y * lattice.cells.z) return;
  const glm::ivec3 at = position_in(static_cast<int>(cell), lattice.cells);
  glm::ivec3 begin, count;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    const float low = (lattice.first[axis] + static_cast<float>(at[axis]) * lattice.cell[axis]) * kVoxelsPerStep,
                high = low + lattice.cell[axis] * kVoxelsPerStep;
    begin[axis] = max(static_cast<int>(floorf(low)) - kAround, 0);
    count[axis] = max(min(static_cast<int>(ceilf(high)) + kAround + 1, size[axis]) - begin[axis], 0);
  }
  ValueHull found;
  for (int n = lane_of_warp(); n < count.x * count.y * count.z; n += 32) {
    const glm::ivec3 voxel = begin + position_in(n, count);
    const auto value = static_cast<int>(voxels[(std::int64_t{voxel.z} * size.y + voxel.y) * size.x + voxel.x]);
    found.least = min(found.least, value);
    found.most = max(found.most, value);
  }
  found = {warp_min(found.least), warp_max(found.most)};
  if (lane_of_warp() == 0) hulls[cell] = found;
}

}  // namespace

void find_content(const StepLattice& lattice, const SeenSource& seen, ValueHull* hulls, cudaStream_t stream) {
  const std::int64_t cells = std::int64_t{lattice.cells.x} * lattice.cells.y * lattice.cells.z;
  dispatch(seen.source.type, [&](auto voxel) {
    using V = decltype(voxel);
    if constexpr (std::is_integral_v<V> && sizeof(V) <= 2) {  // no others are written plainly
      content_of_cells_kernel<<<blocks_for(cells * 32), kThreads, 0, stream>>>(
          lattice, reinterpret_cast<const V*>(seen.source.voxels), glm::ivec3(seen.source.geometry->size), hulls);
    }
  });
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
