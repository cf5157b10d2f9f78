// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/claim.cuh"
#include "cuda/runtime/warp.cuh"

/// Blocks of cells, and which of them may reach some voxels. For claim.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// Cells of a block, and how blocks are numbered.
struct Blocks {
  static constexpr int kX = 32, kY = 4, kZ = 8;  ///< a warp has a row, and a thread block all rows of a slice

  glm::i64vec3 cells, count;  ///< of the lattice: its cells, and its blocks

  explicit Blocks(const DeviceField& field)
      : cells(field.frame.cells), count((cells + glm::i64vec3(kX - 1, kY - 1, kZ - 1)) / glm::i64vec3(kX, kY, kZ)) {}
  __host__ __device__ std::int64_t total() const { return count.x * count.y * count.z; }
  __device__ glm::i64vec3 first_cell(std::int64_t block) const {
    return unravel(block, count) * glm::i64vec3(kX, kY, kZ);
  }
};

/// One thread block a block of cells: the box of its deformed vertices. Warps share out their rows, and threads the
/// last vertices of the rows; each warp finds its box, and atomics in shared memory that of all.
///
/// @param bounds  one for each block of cells, whole voxels: written
__global__ void bounds_kernel(const __grid_constant__ DeviceField field, const __grid_constant__ Blocks blocks,
                              VoxelBounds* bounds) {
  __shared__ int low[3], high[3];
  if (threadIdx.x < 3) {
    low[threadIdx.x] = INT32_MAX;
    high[threadIdx.x] = INT32_MIN;
  }
  __syncthreads();
  const glm::ivec3 first(blocks.first_cell(blockIdx.x)), last(blocks.cells);
  Box box{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  const auto grow = [&](int x, int y, int z) {  // beyond the lattice is its border again
    const glm::ivec3 at = glm::min(first + glm::ivec3(x, y, z), last);
    box.grow(field.vertices ? field.vertex(glm::i64vec3(at)).deformed : field.steps.deformed(at));
  };
  constexpr int kY = Blocks::kY + 1, kRows = kY * (Blocks::kZ + 1);  // of vertices
  const int thread = static_cast<int>(threadIdx.x);
  for (int row = thread / 32; row < kRows; row += kThreads / 32) grow(thread % 32, row % kY, row / kY);
  if (thread < kRows) grow(Blocks::kX, thread % kY, thread / kY);
  for (int axis = 0; axis < 3; ++axis) {
    const int least = warp_min(box.low[axis]), most = warp_max(box.high[axis]);
    if (lane_of_warp() == 0) {
      atomicMin(&low[axis], least);
      atomicMax(&high[axis], most);
    }
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  const auto down = [](int steps) { return steps >> kStepBits; };
  const auto up = [](int steps) { return static_cast<int>((std::int64_t{steps} + kStepsPerVoxel - 1) >> kStepBits); };
  bounds[blockIdx.x] = {{down(low[0]), down(low[1]), down(low[2])}, {up(high[0]), up(high[1]), up(high[2])}};
}

/// Lists the blocks that may reach voxels of the slab, or those of them that `only` names; a thread a block.
///
/// @param bounds  of each block, from `bounds_kernel`  @param blocks  how many
/// @param only    a bit for each voxel of the slab, as `BitRows`; null: all
/// @param chosen  numbers of blocks, in any order: written  @param count  their number: 0 before
__global__ void choose_kernel(const VoxelBounds* bounds, std::int64_t blocks, SlabBox slab, const std::uint32_t* only,
                              unsigned* chosen, unsigned* count) {
  const std::int64_t n = thread_of_grid();
  if (n >= blocks) return;
  const glm::i64vec3 low = glm::max(glm::i64vec3(bounds[n].low) - slab.begin, glm::i64vec3(0));
  const glm::i64vec3 high = glm::min(glm::i64vec3(bounds[n].high) - slab.begin, slab.size - std::int64_t{1});
  if (low.x > high.x || low.y > high.y || low.z > high.z) return;
  bool wanted = only == nullptr;
  const std::int64_t words = (slab.size.x + 31) / 32;
  for (std::int64_t z = low.z; z <= high.z && !wanted; ++z) {
    for (std::int64_t y = low.y; y <= high.y && !wanted; ++y) {
      for (std::int64_t word = low.x / 32; word <= high.x / 32; ++word)
        wanted = wanted || only[(z * slab.size.y + y) * words + word] != 0;
    }
  }
  if (wanted) chosen[atomicAdd(count, 1u)] = static_cast<unsigned>(n);
}

}  // namespace

}  // namespace tetwarp::cuda_detail
