// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/interval_tile.cuh"

/// What a tile takes of the records of its tetrahedra: first their lines, and later their maps. For interval_kernel.cuh
/// alone.
namespace tetwarp::cuda_detail {

namespace {

/// Makes the records of all tetrahedra: a thread each.
template <class Shape>
__global__ void __launch_bounds__(kThreads) record_kernel(const __grid_constant__ Shape shape, Records records) {
  const std::int64_t n = thread_of_grid();
  if (n < records.count) put_record(records, n, shape.tetrahedron(static_cast<unsigned>(n)));
}

/// The part of a tile that a tetrahedron may own. @param words  `VoxelRange` of each axis
template <class Shape>
__device__ IntBox candidates_in(const IntervalTile<Shape>& tile, const glm::ivec3& words) {
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
template <class Shape>
__device__ RowReach reach_of(const IntervalTile<Shape>& tile, const glm::ivec3& words, const IntBox& own) {
  return {tile.voxels.begin - VoxelRange::middle(words), own.begin, own.end - 1, tile.signs};
}

/// Takes the tetrahedra of the list into the slots: their lines, and their rows as items. A thread a tetrahedron.
template <class Shape>
__device__ void read_tetrahedra(const IntervalTile<Shape>& tile) {
  auto& memory = tile.memory;
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
    const int zone = shift_lines(lines, static_cast<int>(RecordFlags::Level::get(flags)), reach_of(tile, words, own));
    const auto lower = static_cast<int>(RecordFlags::Lower::get(flags)),
               upper = static_cast<int>(RecordFlags::Upper::get(flags));
    order_lines(lines, lower, upper, reinterpret_cast<RowLine*>(memory.prepared[slot]));
    const bool is_steep = RecordFlags::Steep::get(flags) != 0 || zone > detail::kMostZone;
    const RowSpan span{own.begin.y,   own.end.y,     own.begin.z,         own.end.z,
                       __popc(lower), __popc(upper), is_steep ? 0 : zone, is_steep};
    memory.spans[slot] = span.word();
    if (RecordFlags::Usable::get(flags) == 0) memory.is_slow = true;
    if (is_steep) {
      const unsigned at = atomicAdd(&memory.steep_count, 1u);
      if (at < kMostUnsure) memory.unsure[kMostUnsure - 1 - at] = static_cast<unsigned>(slot);
      continue;
    }
    // Long ones and short ones apart, so that the lanes of a warp mostly have as much to do.
    const bool is_long = span.z_end - span.z_begin >= Shape::kDepth / 3;
    const auto rows = static_cast<unsigned>(span.y_end - span.y_begin);
    unsigned item = atomicAdd(is_long ? &memory.long_items : &memory.short_items, rows);
#pragma unroll 1
    for (int y = span.y_begin; y < span.y_end; ++y, ++item)
      memory.items[is_long ? item : IntervalTile<Shape>::Memory::kSlots * kTileJ - 1 - item] = RowItem::of(slot, y);
  }
}

/// Whether some voxels of a box of a tile come from the border of the source, or beyond it, by a map; or perhaps.
/// @param axes  U of each axis, from the first voxel of the tile on  @param own  of the tile
template <class Shape, class Sink>
__device__ bool reaches_border(const IntervalTile<Shape>& tile, const int4 (&axes)[3], const IntBox& own,
                               const Sink& sink) {
  constexpr float kFar = 1 << 27;  // 16 voxels: where U changes more, 32 bits may not tell where it ends
  const glm::ivec3 steps = own.end - own.begin - 1;
  glm::ivec3 begin, end;
  bool is_far = false;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    const int4& m = axes[axis];
    const float x = static_cast<float>(m.y) * static_cast<float>(steps.x),
                y = static_cast<float>(m.z) * static_cast<float>(steps.y),
                z = static_cast<float>(m.w) * static_cast<float>(steps.z), change = fabsf(x) + fabsf(y) + fabsf(z);
    const int at = u_on_axis(m, own.begin);
    // The corner of the box may lie outside the tetrahedron, so that U there is just beyond 2^31, and appears on the
    // other side of 0.
    is_far |= !(change < kFar) || fabsf(static_cast<float>(at)) > 0x1p31f - 2 * kFar;
    const auto least = static_cast<int>(fminf(x, 0) + fminf(y, 0) + fminf(z, 0)),
               most = static_cast<int>(fmaxf(x, 0) + fmaxf(y, 0) + fmaxf(z, 0));
    constexpr int kRounded = 1 << 8;  // of three products and sums below 2^27, in float
    begin[axis] = tile.voxels.begin[axis] + own.begin[axis] + ((at + least - kRounded) >> kFixedBits);
    end[axis] = tile.voxels.begin[axis] + own.end[axis] + ((at + most + kRounded) >> kFixedBits);
  }
  return is_far || !sink.surrounds(begin, end);
}

/// Takes the maps of the tetrahedra in the slots, in the place of their lines, from the first voxel of the tile on. The
/// last warps begin, for the first ones read the rows.
template <class Shape, class Sink>
__device__ void read_maps(const IntervalTile<Shape>& tile, const Sink& sink) {
  auto& memory = tile.memory;
#pragma unroll 1
  for (int slot = kTileThreads - 1 - tile.thread; slot < tile.count; slot += kTileThreads) {
    const Records& records = tile.task.records;
    const unsigned number = memory.numbers[slot];
    const int4 box = records.box(number);
    int4 axes[3];
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      axes[axis] = records.map(number, axis);
      axes[axis].x = u_on_axis(axes[axis], tile.voxels.begin);
      memory.prepared[slot][axis] = make_float4(__int_as_float(axes[axis].x), __int_as_float(axes[axis].y),
                                                __int_as_float(axes[axis].z), __int_as_float(axes[axis].w));
    }
    memory.usable[slot] = RecordFlags::Usable::get(static_cast<unsigned>(box.w));
    const IntBox own = candidates_in(tile, {box.x, box.y, box.z});
    if (!own.is_empty() && reaches_border(tile, axes, own, sink)) memory.is_border = true;
  }
}

}  // namespace

}  // namespace tetwarp::cuda_detail
