// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/interval_tile.cuh"

/// The set-up of the interval raster: how far blocks of cells move, and so which cells may reach a tile. For
/// interval_raster.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// One warp a block of 4 x 4 x 4 cells: how far its vertices are displaced.
///
/// @param task  `moves` is written: first those of all cells, which hold 0 before, widened by atomics, then each
/// block's
__global__ void moves_kernel(TileTask task) {
  constexpr int kSide = kBlockCells + 1;
  const int number = static_cast<int>((blockIdx.x * kThreads + threadIdx.x) / 32);
  if (number >= task.blocks.x * task.blocks.y * task.blocks.z) return;
  const StepLattice& lattice = task.lattice;
  const glm::ivec3 first = kBlockCells * position_in(number, task.blocks);
  Box moves{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  for (int n = lane_of_warp(); n < kSide * kSide * kSide; n += 32) {
    const glm::ivec3 vertex = glm::min(first + position_in(n, glm::ivec3(kSide)), lattice.cells);
    moves.grow(glm::i32vec3(lattice.moved(lattice.offset(vertex))));
  }
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    moves.low[axis] = warp_min(moves.low[axis]);
    moves.high[axis] = warp_max(moves.high[axis]);
  }
  if (lane_of_warp() != 0) return;
  task.moves[1 + number] = {moves.low, moves.high};
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    if (moves.low[axis] < task.moves[0].low[axis]) atomicMin(&task.moves[0].low[axis], moves.low[axis]);
    if (moves.high[axis] > task.moves[0].high[axis]) atomicMax(&task.moves[0].high[axis], moves.high[axis]);
  }
}

/// A tile, seen from the lattice: its first and last voxel, 2^-12 voxel from the first vertex at rest on. Nudges, which
/// are less than a step, are left out.
struct TileInLattice {
  const StepLattice& lattice;
  glm::ivec3 low, high;

  __device__ TileInLattice(const StepLattice& of, const IntBox& voxels)
      : lattice(of),
        low(voxels.begin * kStepsPerVoxel - glm::ivec3(of.first)),
        high((voxels.end - 1) * kStepsPerVoxel - glm::ivec3(of.first)) {}

  /// Narrows [from, to] to the cells that may reach the tile where vertices move like that. @return whether any may
  __device__ bool cut(const BlockMoves& moves, glm::ivec3& from, glm::ivec3& to) const {
    constexpr float kBeyond = 1.0f / 32;  // cells: more than the nudge and what rounding costs
    bool any = true;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      const float per_step = lattice.voxel[axis] * kVoxelsPerStep;
      const auto cell_at = [&](int steps, float beyond) {
        return detail::floor_to_int(detail::multiply_add(static_cast<float>(steps), per_step, beyond));
      };
      from[axis] = max(from[axis], cell_at(low[axis] - moves.high[axis], -kBeyond));
      to[axis] = min(to[axis], cell_at(high[axis] - moves.low[axis], kBeyond));
      any &= from[axis] <= to[axis];
    }
    return any;
  }
  /// Whether it lies within the undeformed lattice.
  __device__ bool is_inside() const {
    const glm::ivec3 cell(lattice.cell);
    bool inside = true;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) inside &= low[axis] >= 0 && high[axis] <= lattice.cells[axis] * cell[axis];
    return inside;
  }
};

/// What a warp has found of a tile.
/// @param found  cells that may reach it: low exceeds high where there are none  @param moved  how far their vertices
/// move
__device__ TileCells tile_cells(const IntBox& voxels, const Box& found, const Box& moved, bool is_inside) {
  const bool any = found.low.x <= found.high.x,
             rests = moved.low == glm::i32vec3(0) && moved.high == glm::i32vec3(0) && is_inside && any;
  TileCells cells{any ? found.low : glm::ivec3(0), any ? found.high - found.low + 1 : glm::ivec3(0), {}, {}, rests, 0};
  if (!any) return cells;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis)
    cells.left |= moved.low[axis] <= -kFarForInt32 || moved.high[axis] >= kFarForInt32 ? 1 : 0;
  // Weights are at least -1/64, and wrong by less than 1/256: three move a voxel by less than 1/16 of the range.
  const glm::ivec3 beyond = (moved.high - moved.low) / 16 + kStepsPerVoxel;
  cells.source_begin = (voxels.begin * kStepsPerVoxel - (moved.high + beyond)) >> kStepBits;
  cells.source_end = ((voxels.end * kStepsPerVoxel - (moved.low - beyond)) >> kStepBits) + 1;
  return cells;
}

/// One warp a tile: the cells that may reach it, as a box of cells. First the box of cells that might if all vertices
/// moved as far as any; then, a lane a block of cells, those that do by how far the block's own vertices move.
///
/// @param task  `moves` is read, `cells` written
__global__ void cells_kernel(TileTask task) {
  const int number = static_cast<int>((blockIdx.x * kThreads + threadIdx.x) / 32);
  if (number >= task.tiles.x * task.tiles.y * task.tiles.z) return;
  const StepLattice& lattice = task.lattice;
  const IntBox voxels = task.voxels(position_in(number, task.tiles));
  const TileInLattice tile(lattice, voxels);
  glm::ivec3 from(0), to = lattice.cells - 1;
  Box found{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)}, moved = found;
  if (tile.cut(task.moves[0], from, to)) {
    const glm::ivec3 first = from / kBlockCells, size = to / kBlockCells - first + 1;
    for (int n = lane_of_warp(); n < size.x * size.y * size.z; n += 32) {
      const glm::ivec3 block = first + position_in(n, size);
      const BlockMoves moves = task.moves[1 + (block.z * task.blocks.y + block.y) * task.blocks.x + block.x];
      glm::ivec3 first_cell = block * kBlockCells, last_cell = glm::min(first_cell + kBlockCells, lattice.cells) - 1;
      if (!tile.cut(moves, first_cell, last_cell)) continue;
      found.grow(first_cell);
      found.grow(last_cell);
      moved.grow(moves.low);
      moved.grow(moves.high);
    }
  }
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    found.low[axis] = warp_min(found.low[axis]);
    found.high[axis] = warp_max(found.high[axis]);
    moved.low[axis] = warp_min(moved.low[axis]);
    moved.high[axis] = warp_max(moved.high[axis]);
  }
  if (lane_of_warp() == 0) task.cells[number] = tile_cells(voxels, found, moved, tile.is_inside());
}

}  // namespace

}  // namespace tetwarp::cuda_detail
