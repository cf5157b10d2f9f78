// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/interval_tile.cuh"

/// The walk along the rows of a tile: each tetrahedron of the list marks the intervals that it owns. For
/// interval_raster.cu alone.
///
/// Intervals of different tetrahedra mostly do not overlap. So they are marked in any order at first, an item a thread;
/// a bit that two of them want says that they do overlap, and then the tile is done again: a thread a row, tetrahedron
/// after tetrahedron in the order of their numbers, so that the lowest number wins.
namespace tetwarp::cuda_detail {

namespace {

/// Before the first batch. Rows have no intervals, and nobody has no map.
__device__ void clear_marks(const IntervalTile& tile) {
  TileMemory& memory = tile.memory;
  if (tile.thread < kTileRows) memory.rows[tile.thread].starts = memory.rows[tile.thread].covered = 0;
  if (tile.thread == 0) {
    memory.usable[kSlots] = 0;
    memory.overlaps = false;
    memory.item_count = memory.unsure_count = 0;
  }
}

/// The faces of a tetrahedron; then its rows, as items.
__device__ void set_faces(const IntervalTile& tile, int slot, unsigned entry) {
  TileMemory& memory = tile.memory;
  constexpr float kUnsure = 1e9f;  // the error of what is not for float
  RowSpan span = RowSpan::of(memory.spans[entry]);
  float4* faces = memory.prepared[slot];
  int lower = 0;
  if (span.is_small) {
    const Corners at = tile.corners(memory.numbers[entry]);
    const glm::i32vec3 d = tile.vertex(at.d), a = tile.vertex(at.a) - d, b = tile.vertex(at.b) - d,
                       c = tile.vertex(at.c) - d;
    lower = make_row_faces(a, b, c, d, tile.signs, tile.size,
                           [faces](int n, const RowFace& face) { faces[n] = in_quad(face); });
    if (lower == 0 && detail::edge_determinant(a, b, c) == 0) {  // owns nothing
      span.y_end = span.y_begin;
      memory.spans[entry] = span.word();
    }
  }
  if (lower == 0) {  // exact integers must say
    lower = 2;
#pragma unroll
    for (int n = 0; n < 4; ++n) faces[n] = make_float4(0, 0, 0, kUnsure);
  }
  faces[kLowerQuad].x = __int_as_float(lower);
  unsigned item = atomicAdd(&memory.item_count, static_cast<unsigned>(span.y_end - span.y_begin));
#pragma unroll 1
  for (int y = span.y_begin; y < span.y_end; ++y) memory.items[item++] = RowItem::of(slot, y);
}

/// The interval of a row by exact integers. Rarely called, so out of line, with everything by value.
__device__ __noinline__ RowInterval exactly(const TileTask& task, LatticeTetrahedron t, glm::ivec3 first,
                                            glm::i32vec3 signs, int y, int z, int count) {
  return exact_row(vertices_of(task.lattice, t), first, signs, y, z, count);
}
__device__ RowInterval exact(const IntervalTile& tile, unsigned entry, int y, int z) {
  return exactly(tile.task, tile.tetrahedron(tile.memory.numbers[entry]), tile.voxels.begin, tile.signs, y, z,
                 tile.size.x);
}

/// The bits of an interval that is not empty.
__device__ unsigned bits_of(const RowInterval& in) { return lowest_bits(in.end - in.begin) << in.begin; }

__device__ void mark(const IntervalTile& tile, const RowInterval& in, IntervalRow& row, unsigned entry) {
  if (in.is_empty()) return;
  const unsigned bits = bits_of(in);
  if ((atomicOr(&row.covered, bits) & bits) != 0) {  // then this tile is done again
    tile.memory.overlaps = true;
    return;
  }
  atomicOr(&row.starts, 1u << in.begin);
  row.owner[in.begin] = static_cast<unsigned short>(entry);
}

/// Marks where the intervals of a tetrahedron's rows of one y start.
/// @param batch  entry of the tetrahedron in slot 0  @param item  a `RowItem`
__device__ void mark_item(const IntervalTile& tile, unsigned batch, unsigned item) {
  TileMemory& memory = tile.memory;
  const int slot = static_cast<int>(RowItem::Slot::get(item)), y = static_cast<int>(RowItem::Y::get(item));
  const unsigned entry = batch + static_cast<unsigned>(slot);
  const RowSpan span = RowSpan::of(memory.spans[entry]);
  const RowsAlongZ rows(tile.faces_of(slot), y);
  IntervalRow* row = &memory.rows[span.z_begin * kTileJ + y];
#pragma unroll 1
  for (int z = span.z_begin; z < span.z_end; ++z, row += kTileJ) {
    bool is_certain = false;
    const RowInterval in = rows.interval(z, tile.size.x, is_certain);
    if (is_certain) {
      mark(tile, in, *row, entry);
    } else {  // later: calls would cost this loop registers
      const unsigned at = atomicAdd(&memory.unsure_count, 1u);
      if (at < kMostUnsure) memory.unsure[at] = UnsureRow::of(entry, y, z);
    }
  }
}

/// Marks the intervals of all items, an item a thread; then those that float left open.
__device__ void mark_all(const IntervalTile& tile, unsigned batch) {
  TileMemory& memory = tile.memory;
  const int thread = tile.thread;
  const unsigned items = memory.item_count;
#pragma unroll 1
  for (unsigned from = static_cast<unsigned>(thread & ~31); from < items; from += kTileThreads) {
    const unsigned n = from + static_cast<unsigned>(thread & 31);
    if (n < items) mark_item(tile, batch, memory.items[n]);
    __syncwarp();  // else lanes go on by themselves
  }
  __syncthreads();
  const unsigned unsure = memory.unsure_count;
  if (unsure > kMostUnsure) memory.overlaps = true;
#pragma unroll 1
  for (unsigned n = static_cast<unsigned>(thread); n < min(unsure, static_cast<unsigned>(kMostUnsure));
       n += kTileThreads) {
    const unsigned row = memory.unsure[n], entry = UnsureRow::Entry::get(row);
    const int z = static_cast<int>(UnsureRow::Z::get(row)), y = static_cast<int>(UnsureRow::Y::get(row));
    mark(tile, exact(tile, entry, y, z), memory.rows[z * kTileJ + y], entry);
  }
}

/// Where intervals overlap: a thread a row, tetrahedron after tetrahedron; who comes first has the voxel. Each voxel is
/// an interval of its own then.
__device__ void mark_in_order(const IntervalTile& tile, unsigned batch, unsigned slots) {
  TileMemory& memory = tile.memory;
  if (tile.thread >= kTileRows) return;
  const int y = tile.thread % kTileJ, z = tile.thread / kTileJ;
  IntervalRow& row = memory.rows[tile.thread];
  unsigned covered = row.covered;
#pragma unroll 1
  for (int slot = 0; slot < static_cast<int>(slots); ++slot) {
    const unsigned entry = batch + static_cast<unsigned>(slot);
    const RowSpan span = RowSpan::of(memory.spans[entry]);
    if (y < span.y_begin || y >= span.y_end || z < span.z_begin || z >= span.z_end) continue;
    bool is_certain = false;
    RowInterval in = RowsAlongZ(tile.faces_of(slot), y).interval(z, tile.size.x, is_certain);
    if (!is_certain) in = exact(tile, entry, y, z);
    if (in.is_empty()) continue;
    const unsigned bits = bits_of(in);
    for (unsigned left = bits & ~covered; left != 0; left &= left - 1)
      row.owner[first_bit(left)] = static_cast<unsigned short>(entry);
    covered |= bits;
  }
  row.covered = row.starts = covered;
}

/// Marks all tetrahedra of the list, as many at a time as there is room for: a batch.
__device__ void rasterise(const IntervalTile& tile, bool in_order) {
  TileMemory& memory = tile.memory;
  const int thread = tile.thread;
  const unsigned count = memory.count;
  for (unsigned batch = 0; batch < count; batch += kSlots) {
    const unsigned slots = min(count - batch, static_cast<unsigned>(kSlots));
    __syncthreads();
    static_assert(kSlots <= kTileThreads);
    if (thread < static_cast<int>(slots)) set_faces(tile, thread, batch + static_cast<unsigned>(thread));
    __syncthreads();
    if (in_order) {
      mark_in_order(tile, batch, slots);
    } else {
      mark_all(tile, batch);
    }
    __syncthreads();
    if (thread == 0) memory.item_count = memory.unsure_count = 0;
  }
  __syncthreads();
}

/// Where nobody owns, an interval of nobody's starts. A thread a row.
__device__ void mark_holes(const IntervalTile& tile) {
  if (tile.thread >= kTileRows) return;
  IntervalRow& row = tile.memory.rows[tile.thread];
  const unsigned holes = ~row.covered, starts = holes & ~(holes << 1);
  for (unsigned left = starts; left != 0; left &= left - 1) row.owner[first_bit(left)] = kNoOwner;
  row.starts |= starts;
}

}  // namespace

}  // namespace tetwarp::cuda_detail
