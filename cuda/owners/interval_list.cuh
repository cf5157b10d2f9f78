// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/interval_tile.cuh"

/// The list of a tile: which tetrahedra may own voxels of it. For interval_raster.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// Whether a tetrahedron may own voxels of the tile.
/// @param number  a `TetrahedronInTile`  @param span  set to the rows that it may reach
__device__ bool may_own(const IntervalTile& tile, unsigned number, RowSpan& span) {
  const Corners at = tile.corners(number);
  const glm::i32vec3 d = tile.vertex(at.d);
  Box box{d, d};
  box.grow(tile.vertex(at.a));
  box.grow(tile.vertex(at.b));
  box.grow(tile.vertex(at.c));
  IntBox own{glm::ivec3(0), tile.size};
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {  // as `cut_to_candidates`, where all voxels are nudged alike
    const int low = box.low[axis] - (tile.signs[axis] > 0 ? 1 : 0),
              high = box.high[axis] - (tile.signs[axis] > 0 ? 1 : 0);
    own.begin[axis] = max(own.begin[axis], (low >> kStepBits) + 1);
    own.end[axis] = min(own.end[axis], (high >> kStepBits) + 1);
  }
  span = {own.begin.y, own.end.y, own.begin.z, own.end.z, fits_int64(box)};
  return !own.is_empty();
}

/// Lists the tetrahedra that may own voxels of the tile, in rising order: a thread a tetrahedron, 256 at a time.
/// @return whether there is room for them
__device__ bool list_tetrahedra(const IntervalTile& tile) {
  TileMemory& memory = tile.memory;
  const glm::ivec3& cells = tile.cells;
  if (cells.x > kMostCells.x || cells.y > kMostCells.y || cells.z > kMostCells.z) return false;
  if (cells.x * cells.y * cells.z > kMostCellsInAll) return false;
  const int total = cells.x * cells.y * cells.z * kTetrahedraPerCell, lane = tile.lane(), warp = tile.warp();
  unsigned listed = 0;
#pragma unroll 1
  for (int from = 0; from < total; from += kTileThreads) {
    const int n = from + tile.thread, cell = n / kTetrahedraPerCell;
    const Divided row = divided(cell, cells.x), slice = divided(row.quotient, cells.y);
    const unsigned number = TetrahedronInTile::of({row.rest, slice.rest, slice.quotient}, n % kTetrahedraPerCell);
    RowSpan span{};
    const bool reaches = n < total && may_own(tile, number, span);
    const unsigned entry = rank_in_block(reaches, lane, warp, memory.per_warp, listed);
    if (reaches && entry < kMostTetrahedra) {
      memory.numbers[entry] = number;
      memory.spans[entry] = span.word();
    }
    __syncthreads();
    if (listed > kMostTetrahedra) return false;
  }
  if (tile.thread == 0) memory.count = listed;
  __syncthreads();
  return true;
}

}  // namespace

}  // namespace tetwarp::cuda_detail
