// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/interval_tile.cuh"

/// The set-up of the interval raster: the records of all tetrahedra, once a field; and for each tile of a box the list
/// of those that may own voxels of it. For interval_raster.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// The tetrahedra of a lattice, number 5 cell + which, as tiles see them.
/// @tparam kOf  `kDepth`: kTileK, or half of it where cells are small
template <int kOf>
struct LatticeShape {
  static constexpr int kDepth = kOf, kSlots = slots_of(kDepth);

  StepLattice lattice;
  TileCount* counts;      ///< of each tile, i fastest
  unsigned* lists;        ///< of each tile, up to kSlots numbers; both from `list_kernel`
  const TileCount* deep;  ///< of tiles of twice the depth, where those are wanted alone that had no room; or null
  glm::ivec3 deep_tiles;  ///< how many of those on each axis

  __device__ LatticeTetrahedron named(unsigned number) const {
    const glm::ivec3 cell = position_in(static_cast<int>(number / kTetrahedraPerCell), lattice.cells);
    return LatticeTetrahedron::of_cell(cell, static_cast<int>(number % kTetrahedraPerCell));
  }
  __device__ Tetrahedron tetrahedron(unsigned number) const { return vertices_of(lattice, named(number)); }
  __device__ TileList list(const glm::ivec3& at, int tile) const {
    const TileCount of = counts[tile];
    return {lists + std::int64_t{tile} * kSlots, of.all, of.all != 0 && of.moving == 0, is_done(at)};
  }
  /// Whether a tile of twice the depth had room.
  __device__ bool is_done(const glm::ivec3& at) const {
    return deep && deep[(at.z / 2 * deep_tiles.y + at.y) * deep_tiles.x + at.x].all <= slots_of(2 * kDepth);
  }
  /// They are owned where the tile lies within the undeformed lattice, and all cells that reach it there are at rest.
  __device__ bool rests(const IntBox& voxels, const Records& records, int thread) const {
    const glm::ivec3 size(lattice.cell), low = voxels.begin * kStepsPerVoxel - glm::ivec3(lattice.first),
                                         high = (voxels.end - 1) * kStepsPerVoxel - glm::ivec3(lattice.first);
    bool is = true;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) is = is && low[axis] >= 0 && high[axis] <= lattice.cells[axis] * size[axis];
    if (!is) return false;
    // Nudges are less than a step; a voxel on the border of two cells may be either's.
    const glm::ivec3 first = glm::max(low - 1, glm::ivec3(0)) / size,
                     count = glm::min((high + 1) / size, lattice.cells - 1) - first + 1;
    for (int z = thread / 32; z < count.z; z += kTileJ) {
      for (int y = 0; y < count.y; ++y) {
        const std::int64_t row = std::int64_t{first.z + z} * lattice.cells.y + first.y + y,
                           at = (row * lattice.cells.x + first.x) * kTetrahedraPerCell;
        for (int n = thread & 31; n < count.x * kTetrahedraPerCell; n += 32)
          is = is && RecordFlags::AtRest::get(static_cast<unsigned>(records.box(at + n).w)) != 0;
      }
    }
    return __syncthreads_and(is ? 1 : 0) != 0;
  }
};

/// The tiles that a tetrahedron may reach, whichever way they are nudged.
struct TileRange {
  glm::ivec3 first{0}, last{-1};

  /// @param box  of a record  @param around  voxels by which it is larger on all sides
  template <class Shape>
  __device__ TileRange(const TileTask<Shape>& task, const int4& box, int around = 0) {
    const glm::ivec3 words(box.x, box.y, box.z), extent(kTileI, kTileJ, Shape::kDepth);
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      const int begin = max(VoxelRange::from(VoxelRange::low(words[axis]), 1) - around, task.box.begin[axis]),
                end = min(VoxelRange::from(VoxelRange::high(words[axis]), -1) + around, task.box.end[axis]) - 1;
      any = any && begin <= end;
      first[axis] = (begin - task.origin[axis]) / extent[axis];
      last[axis] = (end - task.origin[axis]) / extent[axis];
    }
  }

  /// Calls `use` with the number of each.
  template <class Shape, class Use>
  __device__ void for_each(const TileTask<Shape>& task, Use&& use) const {
    if (!any) return;
    for (glm::ivec3 at = first; at.z <= last.z; ++at.z) {
      for (at.y = first.y; at.y <= last.y; ++at.y) {
        for (at.x = first.x; at.x <= last.x; ++at.x) use(task.tile_number(at));
      }
    }
  }

  bool any = true;
};

/// Enters each tetrahedron into the lists of all wanted tiles that its box reaches: a thread a tetrahedron. Neighbours
/// mostly want the same tile, so a warp takes room for all of its lanes with one atomic addition a tile.
///
/// @param task  the shape's counts are 0 before, and added to; its lists are written
template <class Shape>
__global__ void __launch_bounds__(kThreads) list_kernel(const __grid_constant__ TileTask<Shape> task) {
  const std::int64_t n = thread_of_grid();
  bool any = n < task.records.count;
  const int4 box = any ? task.records.box(n) : int4{};
  const TileRange range(task, box);
  any = any && range.any;
  const bool moves = any && RecordFlags::AtRest::get(static_cast<unsigned>(box.w)) == 0;
  glm::ivec3 at = range.first;
  while (__any_sync(kAllLanes, any)) {
    const int tile = any && task.kept.is_wanted(task.tile_number(at)) ? task.tile_number(at) : -1;
    const unsigned same = __match_any_sync(kAllLanes, tile);
    const unsigned moving = __ballot_sync(kAllLanes, moves) & same;
    unsigned from = 0;
    const int leader = first_bit(same);
    if (tile >= 0 && lane_of_warp() == leader) {
      from = atomicAdd(&task.shape.counts[tile].all, static_cast<unsigned>(__popc(same)));
      if (moving != 0) task.shape.counts[tile].moving = 1;
    }
    from = __shfl_sync(kAllLanes, from, leader);
    if (!any) continue;
    const unsigned entry = from + static_cast<unsigned>(__popc(same & bits_below(lane_of_warp())));
    if (tile >= 0 && entry < Shape::kSlots)
      task.shape.lists[std::int64_t{tile} * Shape::kSlots + entry] = static_cast<unsigned>(n);
    if (++at.x <= range.last.x) continue;
    at.x = range.first.x;
    if (++at.y <= range.last.y) continue;
    at.y = range.first.y;
    any = ++at.z <= range.last.z;
  }
}

/// Voxels around a tile whose values may show in a picture that shows its own: samples of a ray are at most a voxel
/// apart, and their values and light come from voxels less than two away.
constexpr int kSeenAround = 3;

/// Adds what a tetrahedron brings to the tiles in or near which it may own voxels.
template <class Shape>
__device__ void add_content(const TileTask<Shape>& task, std::int64_t n) {
  const ValueHull brought = task.kept.cells[n / kTetrahedraPerCell];
  TileRange(task, task.records.box(n), kSeenAround).for_each(task, [&](int tile) {
    task.kept.add_content(tile, brought);
  });
}

/// What all tiles contain: a thread a tetrahedron. @param task  with what nobody brings in `kept.content`: added to
template <class Shape>
__global__ void __launch_bounds__(kThreads) content_kernel(const __grid_constant__ TileTask<Shape> task) {
  const std::int64_t n = thread_of_grid();
  if (n < task.records.count) add_content(task, n);
}

/// Decides which tiles are made: those that have changed since they were, unless nothing is seen there. A thread a
/// tile.
///
/// @param kept     `covered` becomes 0 where a tile is made  @param tiles  how many  @param seen  without content: not
///                 asked
/// @param changed  whether a tile has changed now; becomes whether it is made
/// @param stale    whether it has changed before, and was left: becomes whether it is left
__global__ void __launch_bounds__(kThreads)
    choose_kernel(KeptTiles kept, int tiles, SeenRanges seen, std::uint8_t* changed, std::uint8_t* stale) {
  const auto n = static_cast<int>(thread_of_grid());
  if (n >= tiles) return;
  const bool differs = changed[n] != 0 || stale[n] != 0,
             is_made = differs && (!kept.content || seen.meet(kept.content[n]));
  changed[n] = is_made ? 1 : 0;
  stale[n] = differs && !is_made ? 1 : 0;
  if (is_made) kept.covered[n] = 0;
}

/// The vertices of the field before, as StepLattice has them.
struct VerticesBefore {
  const std::uint64_t* packed;
  StepPacking packing;
};

/// Makes anew the records of tetrahedra of which a vertex has moved, and tells which tiles these reach now or reached
/// before: a thread a tetrahedron.
///
/// @param task     its records are those of the field before, and become those of this one; what they bring is added
/// @param changed  of each tile: 0 before, set to 1
template <class Shape>
__global__ void __launch_bounds__(kThreads)
    change_kernel(const __grid_constant__ TileTask<Shape> task, VerticesBefore before, std::uint8_t* changed) {
  const std::int64_t n = thread_of_grid();
  if (n >= task.records.count) return;
  const StepLattice& lattice = task.shape.lattice;
  const auto t = task.shape.named(static_cast<unsigned>(n));
  bool moved = false;
  for (const glm::ivec3& vertex : {t.a(), t.b(), t.c(), t.d}) {
    const std::int64_t at = lattice.offset(vertex);
    moved |= lattice.moved(at) != before.packing.unpacked(before.packed[at]);
  }
  if (!moved) return;
  const auto mark = [&] { TileRange(task, task.records.box(n)).for_each(task, [&](int tile) { changed[tile] = 1; }); };
  mark();
  put_record(task.records, n, vertices_of(lattice, t));
  mark();
  if (task.kept.content) add_content(task, n);
}

}  // namespace

}  // namespace tetwarp::cuda_detail
