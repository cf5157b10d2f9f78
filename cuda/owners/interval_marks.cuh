// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/interval_read.cuh"

/// The walk along the rows of a tile: each tetrahedron of the list marks the intervals that it owns. For
/// interval_kernel.cuh alone.
///
/// Intervals of different tetrahedra mostly do not overlap. So they are marked in any order at first, an item a thread;
/// where two start at one voxel, the first to come is kept. Then each row is read once: where an interval starts before
/// the last one ends, or fewer voxels are found than were marked, some do overlap, and the tile is done again: a thread
/// a row, tetrahedron after tetrahedron in the order of their numbers, so that the lowest number wins.
namespace tetwarp::cuda_detail {

namespace {

/// Before anything is marked. Rows have no intervals, and nobody has no map.
template <class Shape>
__device__ void clear_marks(const IntervalTile<Shape>& tile) {
  auto& memory = tile.memory;
  if (tile.thread < IntervalTile<Shape>::Memory::kRows) memory.starts[tile.thread] = 0;
  if (tile.thread != 0) return;
  memory.usable[IntervalTile<Shape>::Memory::kNobody] = 0;
  memory.long_items = memory.short_items = memory.unsure_count = memory.steep_count = memory.marked = memory.covered =
      0;
  memory.is_border = memory.is_slow = false;
}

/// The interval of a row by exact integers. Rarely called, so out of line, with everything by value.
template <class Shape>
__device__ __noinline__ RowInterval exactly(const Shape& shape, unsigned number, glm::ivec3 first, glm::i32vec3 signs,
                                            int y, int z, int count) {
  return exact_row(shape.tetrahedron(number), first, signs, y, z, count);
}
template <class Shape>
__device__ RowInterval exact(const IntervalTile<Shape>& tile, int slot, int y, int z) {
  return exactly(tile.task.shape, tile.memory.numbers[slot], tile.voxels.begin, tile.signs, y, z, tile.size.x);
}

/// Whether a tetrahedron owns a voxel, by exact integers; as `exactly`.
template <class Shape>
__device__ __noinline__ bool owns(const Shape& shape, unsigned number, glm::ivec3 voxel, glm::i32vec3 signs) {
  int sides[4];
  return owns_exactly(shape.tetrahedron(number), voxel * kStepsPerVoxel, signs, sides);
}

/// Marks an interval of a row that is not empty. Where another one starts there, it is lost: the rows will have fewer
/// voxels than were marked. @return how many it has
__device__ int put_interval(unsigned* starts, unsigned short* owners, int slot, int begin, int end) {
  if ((atomicOr(starts, 1u << begin) >> begin & 1) == 0) owners[begin] = RowOwner::of(static_cast<unsigned>(slot), end);
  return end - begin;
}
/// Marks an interval. @return how many voxels it has
template <class Shape>
__device__ int mark(const IntervalTile<Shape>& tile, const RowInterval& in, int slot, int row) {
  if (in.is_empty()) return 0;
  return put_interval(&tile.memory.starts[row], tile.memory.owners[row], slot, in.begin, in.end);
}

/// Leaves a row for later: calls would cost the loops over rows registers.
template <class Memory>
__device__ void leave(Memory& memory, unsigned unsure) {
  const unsigned at = atomicAdd(&memory.unsure_count, 1u);
  if (at + memory.steep_count < kMostUnsure) memory.unsure[at] = unsure;
}

/// Marks where the intervals of a tetrahedron's rows of one y start. @return how many voxels they have
template <class Shape>
__device__ int mark_item(const IntervalTile<Shape>& tile, unsigned item) {
  auto& memory = tile.memory;
  const int slot = static_cast<int>(RowItem::Slot::get(item)), y = static_cast<int>(RowItem::Y::get(item));
  const RowSpan span = RowSpan::of(memory.spans[slot]);
  RowLine lines[4];
  read_lines(memory.prepared[slot], lines);
  const LinesAlongZ rows(lines, span.lower, span.upper, span.zone, y, tile.size.x);
  const int first = span.z_begin * kTileJ + y;
  unsigned* starts = &memory.starts[first];
  unsigned short* owners = memory.owners[first];
  int marked = 0;
#pragma unroll 1
  for (int z = span.z_begin; z < span.z_end; ++z, starts += kTileJ, owners += kTileJ * kTileI) {
    const LinesAlongZ::Ends of = rows.ends(z);
    if (!of.is_certain) {
      leave(memory, UnsureRow::of(slot, z * kTileJ + y, rows.doubt(of)));
    } else if (of.begin() < of.end()) {
      marked += put_interval(starts, owners, slot, of.begin() & (kTileI - 1), of.end() - detail::kLiftedWhole);
    }
  }
  return marked;
}

/// Marks the rows of tetrahedra of steep lines, a thread a row of each. They are few, but one thread for several rows
/// of them would keep all others waiting. @return how many voxels
template <class Shape>
__device__ int mark_steep(const IntervalTile<Shape>& tile) {
  auto& memory = tile.memory;
  constexpr int kRows = IntervalTile<Shape>::Memory::kRows;
  const int steep = static_cast<int>(min(memory.steep_count, static_cast<unsigned>(kMostUnsure))),
            row = tile.thread % kRows, y = row % kTileJ, z = row / kTileJ;
  int marked = 0;
#pragma unroll 1
  for (int n = tile.thread / kRows; n < steep; n += kTileThreads / kRows) {
    const auto slot = static_cast<int>(memory.unsure[kMostUnsure - 1 - n]);
    const RowSpan span = RowSpan::of(memory.spans[slot]);
    if (!span.has(y, z)) continue;
    if (span.lower == 0) {
      leave(memory, UnsureRow::of(slot, row));
      continue;
    }
    RowLine lines[4];
    read_lines(memory.prepared[slot], lines);
    const int4 box = tile.task.records.box(memory.numbers[slot]);
    const glm::ivec3 words(box.x, box.y, box.z);
    const RowReach reach = reach_of(tile, words, candidates_in(tile, words));
    bool is_certain = false;
    const RowInterval in =
        RowsAlongZ(steep_faces(lines, span.lower, span.upper, reach), y).interval(z, tile.size.x, is_certain);
    if (is_certain) {
      marked += mark(tile, in, slot, row);
    } else {
      leave(memory, UnsureRow::of(slot, row));
    }
  }
  return marked;
}

/// Marks rows of which floats left the ends open, two lanes a row, each for one end: exact integers take long. A whole
/// warp calls it.
/// @param unsure   of this lane's row  @param is_any  whether there is one
/// @return how many voxels, in the first lane of each row
template <class Shape>
__device__ int mark_in_doubt(const IntervalTile<Shape>& tile, unsigned unsure, bool is_any) {
  const int slot = static_cast<int>(UnsureRow::Slot::get(unsure)), row = static_cast<int>(UnsureRow::Row::get(unsure));
  const RowInterval core{static_cast<int>(UnsureRow::Begin::get(unsure)),
                         static_cast<int>(UnsureRow::End::get(unsure))};
  const bool is_behind = (tile.lane() & 1) != 0,
             in_doubt = (is_behind ? UnsureRow::Behind::get(unsure) : UnsureRow::Before::get(unsure)) != 0;
  const glm::ivec3 in_tile(is_behind ? core.end : core.begin - 1, row % kTileJ, row / kTileJ);
  const bool is_owner =
      is_any && in_doubt && owns(tile.task.shape, tile.memory.numbers[slot], tile.voxels.begin + in_tile, tile.signs);
  const unsigned owners = __ballot_sync(kAllLanes, is_owner) >> tile.lane();
  if (!is_any || is_behind) return 0;
  return mark(tile, settled(core, (owners & 1) != 0, (owners & 2) != 0), slot, row);
}

/// Marks a row of which nothing is known, by a warp: a lane a voxel. @return how many voxels, in one lane
template <class Shape>
__device__ int mark_unknown(const IntervalTile<Shape>& tile, unsigned unsure) {
  const int slot = static_cast<int>(UnsureRow::Slot::get(unsure)), row = static_cast<int>(UnsureRow::Row::get(unsure));
  const bool is = tile.lane() < tile.size.x &&
                  owns(tile.task.shape, tile.memory.numbers[slot],
                       tile.voxels.begin + glm::ivec3(tile.lane(), row % kTileJ, row / kTileJ), tile.signs);
  const unsigned owned = __ballot_sync(kAllLanes, is);
  if (tile.lane() != 0 || owned == 0) return 0;
  return mark(tile, {first_bit(owned), last_bit(owned) + 1}, slot, row);
}

/// Adds what the lanes of a whole warp have to a sum of the tile.
template <class Shape>
__device__ void add_up(const IntervalTile<Shape>& tile, int voxels, unsigned& to) {
  const unsigned sum = warp_sum(static_cast<unsigned>(voxels));
  if (tile.lane() == 0) atomicAdd(&to, sum);
}

/// Marks the intervals of all tetrahedra in the slots, an item a thread; then what lines left open.
template <class Shape>
__device__ void mark_all(const IntervalTile<Shape>& tile) {
  auto& memory = tile.memory;
  const unsigned long_items = memory.long_items, items = long_items + memory.short_items;
  int marked = 0;
#pragma unroll 1
  for (unsigned from = static_cast<unsigned>(tile.thread & ~31); from < items; from += kTileThreads) {
    const unsigned n = from + static_cast<unsigned>(tile.lane());
    if (n < items)
      marked += mark_item(
          tile, memory.items[n < long_items ? n : IntervalTile<Shape>::Memory::kSlots * kTileJ - 1 - (n - long_items)]);
    __syncwarp();  // else lanes go on by themselves
  }
  marked += mark_steep(tile);
  __syncthreads();
  const unsigned unsure = tile.has_lost_rows() ? 0 : memory.unsure_count;
#pragma unroll 1
  for (unsigned from = static_cast<unsigned>(tile.thread & ~31) / 2; from < unsure; from += kTileThreads / 2) {
    const unsigned n = from + static_cast<unsigned>(tile.lane()) / 2, word = memory.unsure[min(n, unsure - 1)];
    marked += mark_in_doubt(tile, word, n < unsure && UnsureRow::Unknown::get(word) == 0);
  }
#pragma unroll 1
  for (unsigned n = static_cast<unsigned>(tile.warp()); n < unsure; n += kTileJ)
    if (UnsureRow::Unknown::get(memory.unsure[n]) != 0) marked += mark_unknown(tile, memory.unsure[n]);
  add_up(tile, marked, memory.marked);
}

/// Reads the rows, a thread each: where nobody owns, an interval of nobody's starts, and voxels that have an owner are
/// counted.
template <class Shape>
__device__ void read_rows(const IntervalTile<Shape>& tile) {
  constexpr int kOverlap = 1 << 16;  // more than a tile has voxels
  auto& memory = tile.memory;
  if (tile.thread >= IntervalTile<Shape>::Memory::kRows) return;
  int owned = 0, at = 0;
  if (tile.thread % kTileJ < tile.size.y && tile.thread / kTileJ < tile.size.z) {
    unsigned short* owners = memory.owners[tile.thread];
    const unsigned starts = memory.starts[tile.thread];
    unsigned holes = 0;
    const auto put_hole = [&](int end) {
      holes |= 1u << at;
      owners[at] = RowOwner::of(IntervalTile<Shape>::Memory::kNobody, end);
    };
    for (unsigned left = starts; left != 0; left &= left - 1) {
      const int begin = first_bit(left), end = static_cast<int>(RowOwner::End::get(owners[begin]));
      if (begin > at) put_hole(begin);
      if (begin < at) owned += kOverlap;
      owned += end - begin;
      at = end;
    }
    if (at < tile.size.x) put_hole(tile.size.x);
    memory.starts[tile.thread] = starts | holes;
  }
  __syncwarp();
  add_up(tile, owned, memory.covered);
}

/// Slots in the order of their tetrahedra's numbers, in the place of items.
template <class Shape>
__device__ void sort_slots(const IntervalTile<Shape>& tile) {
  auto& memory = tile.memory;
  for (int slot = tile.thread; slot < tile.count; slot += kTileThreads) {
    const unsigned number = memory.numbers[slot];
    int before = 0;
    for (int n = 0; n < tile.count; ++n) before += memory.numbers[n] < number ? 1 : 0;
    memory.items[before] = static_cast<unsigned short>(slot);
  }
}

/// Where intervals overlap: a thread a row, tetrahedron after tetrahedron; who comes first has the voxel. Each voxel is
/// an interval of its own then.
template <class Shape>
__device__ void mark_in_order(const IntervalTile<Shape>& tile) {
  auto& memory = tile.memory;
  if (tile.thread >= IntervalTile<Shape>::Memory::kRows) return;
  const int y = tile.thread % kTileJ, z = tile.thread / kTileJ;
  unsigned covered = 0;
#pragma unroll 1
  for (int n = 0; n < tile.count; ++n) {
    const int slot = memory.items[n];
    const RowSpan span = RowSpan::of(memory.spans[slot]);
    if (!span.has(y, z)) continue;
    bool is_certain = false;
    RowInterval in{0, 0};
    if (!span.is_steep) {
      RowLine lines[4];
      read_lines(memory.prepared[slot], lines);
      const LinesAlongZ::Ends ends = LinesAlongZ(lines, span.lower, span.upper, span.zone, y, tile.size.x).ends(z);
      is_certain = ends.is_certain;
      if (is_certain) in = LinesAlongZ::interval(ends);
    }
    if (!is_certain) in = exact(tile, slot, y, z);
    if (in.is_empty()) continue;
    const unsigned bits = lowest_bits(in.end - in.begin) << in.begin;
    for (unsigned left = bits & ~covered; left != 0; left &= left - 1) {
      const int x = first_bit(left);
      memory.owners[tile.thread][x] = RowOwner::of(static_cast<unsigned>(slot), x + 1);
    }
    covered |= bits;
  }
  memory.starts[tile.thread] = covered;
}

}  // namespace

}  // namespace tetwarp::cuda_detail
