// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/interval_tile.cuh"

/// The set-up of the interval raster: the records of all tetrahedra, once a field; and for each tile of a box the list
/// of those that may own voxels of it. For interval_raster.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// Makes the records of a lattice: a thread a tetrahedron.
__global__ void __launch_bounds__(kThreads) record_kernel(const __grid_constant__ TileTask task) {
  const std::int64_t n = thread_of_grid();
  if (n >= task.records.count) return;
  put_record(task.records, n, vertices_of(task.lattice, task.tetrahedron(static_cast<unsigned>(n))));
}

/// Enters each tetrahedron into the lists of all tiles that its box reaches: a thread a tetrahedron. Neighbours mostly
/// want the same tile, so a warp takes room for all of its lanes with one atomic addition a tile.
///
/// @param task  `counts` are 0 before, and added to; `lists` are written
__global__ void __launch_bounds__(kThreads) list_kernel(const __grid_constant__ TileTask task) {
  const std::int64_t n = thread_of_grid();
  bool any = n < task.records.count;
  glm::ivec3 begin(0), end(0);
  bool moves = false;
  if (any) {
    const int4 box = task.records.box(n);
    moves = RecordFlags::AtRest::get(static_cast<unsigned>(box.w)) == 0;
    const glm::ivec3 words(box.x, box.y, box.z), extent(kTileI, kTileJ, kTileK);
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {  // whichever way tiles are nudged
      const int first = max(VoxelRange::from(VoxelRange::low(words[axis]), 1), task.box.begin[axis]),
                last = min(VoxelRange::from(VoxelRange::high(words[axis]), -1), task.box.end[axis]) - 1;
      any = any && first <= last;
      begin[axis] = (first - task.origin[axis]) / extent[axis];
      end[axis] = (last - task.origin[axis]) / extent[axis];
    }
  }
  glm::ivec3 at = begin;
  while (__any_sync(kAllLanes, any)) {
    const int tile = any ? task.tile_number(at) : -1;
    const unsigned same = __match_any_sync(kAllLanes, tile);
    const unsigned moving = __ballot_sync(kAllLanes, moves) & same;
    unsigned from = 0;
    const int leader = first_bit(same);
    if (any && lane_of_warp() == leader) {
      from = atomicAdd(&task.counts[tile].all, static_cast<unsigned>(__popc(same)));
      if (moving != 0) task.counts[tile].moving = 1;
    }
    from = __shfl_sync(kAllLanes, from, leader);
    if (!any) continue;
    const unsigned entry = from + static_cast<unsigned>(__popc(same & bits_below(lane_of_warp())));
    if (entry < kSlots) task.lists[std::int64_t{tile} * kSlots + entry] = static_cast<unsigned>(n);
    if (++at.x <= end.x) continue;
    at.x = begin.x;
    if (++at.y <= end.y) continue;
    at.y = begin.y;
    any = ++at.z <= end.z;
  }
}

/// The part of a tile that a tetrahedron may own. @param words  `VoxelRange` of each axis
__device__ IntBox candidates_in(const IntervalTile& tile, const glm::ivec3& words) {
  IntBox own;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    const auto from = [&](int half) { return VoxelRange::from(half, tile.signs[axis]) - tile.voxels.begin[axis]; };
    own.begin[axis] = max(from(VoxelRange::low(words[axis])), 0);
    own.end[axis] = min(from(VoxelRange::high(words[axis])), tile.size[axis]);
  }
  return own;
}

/// The rows of a tile that a tetrahedron may reach, as its lines see them. @param own  `candidates_in`
__device__ RowReach reach_of(const IntervalTile& tile, const glm::ivec3& words, const IntBox& own) {
  return {tile.voxels.begin - VoxelRange::middle(words), own.begin, own.end - 1, tile.signs};
}

/// Whether voxels of a tetrahedron may come from the border of the source, or beyond. A voxel may lie beside the
/// tetrahedron by less than a step; where maps are not too steep it comes from at most 1/32 voxel beside it.
template <class Sink>
__device__ bool reaches_border(const TileTask& task, unsigned number, const Sink& sink) {
  constexpr int kBeside = kStepsPerVoxel / 16;
  const glm::i32vec3 size(task.lattice.cell), low = glm::i32vec3(task.lattice.first) + task.cell_of(number) * size;
  return !sink.surrounds((low - kBeside) >> kStepBits, ((low + size + kBeside) >> kStepBits) + 1);
}

/// Takes the tetrahedra of the list into the slots: their lines, and their rows as items. A thread a tetrahedron.
template <class Sink>
__device__ void read_tetrahedra(const IntervalTile& tile, const Sink& sink) {
  TileMemory& memory = tile.memory;
#pragma unroll 1
  for (int slot = tile.thread; slot < tile.count; slot += kTileThreads) {
    const unsigned number = tile.list[slot];
    const Records& records = tile.task.records;
    const int4 box = records.box(number);
    memory.numbers[slot] = number;
    memory.spans[slot] = 0;
    const glm::ivec3 words(box.x, box.y, box.z);
    const IntBox own = candidates_in(tile, words);
    if (own.is_empty()) continue;
    const auto flags = static_cast<unsigned>(box.w);
    RowLine lines[4];
    read_lines(records, number, lines);
    const int zone = shift_lines(lines, reach_of(tile, words, own));
    const auto lower = static_cast<int>(RecordFlags::Lower::get(flags)),
               upper = static_cast<int>(RecordFlags::Upper::get(flags));
    auto* const ordered = reinterpret_cast<RowLine*>(memory.prepared[slot]);
#pragma unroll
    for (int face = 0; face < 4; ++face)
      if (((lower | upper) >> face & 1) != 0) ordered[place_of_line(lower, upper, face)] = lines[face];
    const bool is_steep = RecordFlags::Steep::get(flags) != 0 || zone > detail::kMostZone;
    const RowSpan span{own.begin.y,   own.end.y,     own.begin.z,         own.end.z,
                       __popc(lower), __popc(upper), is_steep ? 0 : zone, is_steep};
    memory.spans[slot] = span.word();
    if (RecordFlags::Usable::get(flags) == 0) memory.is_slow = true;
    if (reaches_border(tile.task, number, sink)) memory.is_border = true;
    if (is_steep) {
      const unsigned at = atomicAdd(&memory.steep_count, 1u);
      if (at < kMostUnsure) memory.unsure[kMostUnsure - 1 - at] = static_cast<unsigned>(slot);
      continue;
    }
    // Long ones and short ones apart, so that the lanes of a warp mostly have as much to do.
    const bool is_long = span.z_end - span.z_begin >= kTileK / 3;
    const auto rows = static_cast<unsigned>(span.y_end - span.y_begin);
    unsigned item = atomicAdd(is_long ? &memory.long_items : &memory.short_items, rows);
#pragma unroll 1
    for (int y = span.y_begin; y < span.y_end; ++y, ++item)
      memory.items[is_long ? item : kSlots * kTileJ - 1 - item] = RowItem::of(slot, y);
  }
}

}  // namespace

}  // namespace tetwarp::cuda_detail
