// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/interval_raster.cuh"
#include "cuda/owners/tetrahedron_records.cuh"
#include "cuda/runtime/warp.cuh"

/// A tile of a coarse field: what a thread block knows of it, its shared memory, and the words in it. Lattices and
/// meshes share it (interval_raster.cu, mesh_raster.cu); interval_read.cuh, interval_marks.cuh and interval_sample.cuh
/// are what is done with it, in this order, and interval_kernel.cuh does it.
namespace tetwarp::cuda_detail {

namespace {

/// Tetrahedra of a tile, at most: as many as leave room for five tiles a multiprocessor, and 60 KiB of L1.
constexpr int slots_of(int depth) { return depth == kTileK ? 384 : 432; }
constexpr int kMostUnsure = 256;  ///< rows for exact integers, and steep tetrahedra

/// Which tetrahedra may reach a tile.
struct TileList {
  const unsigned* numbers;  ///< in any order
  unsigned long long count;
  bool may_rest;  ///< whether all of them are at rest
  bool is_done;   ///< whether the tile is not wanted
};

/// What stays of tiles from one field to the next, an entry a tile, i fastest.
struct KeptTiles {
  const std::uint8_t* changed;  ///< whether a tile must be made again; null: all must
  unsigned* covered;            ///< voxels that a tile covered, 0 before it is made again; null: not wanted
  const ValueHull* cells;       ///< values that each cell of the lattice brings
  ValueHull* content;           ///< values in and around each tile since all were made; null: not wanted

  /// Adds what a cell brings.
  __device__ void add_content(int tile, const ValueHull& hull) const {
    ValueHull& held = content[tile];  // others only widen it, so mostly a look is enough
    if (hull.least < held.least) atomicMin(&held.least, hull.least);
    if (hull.most > held.most) atomicMax(&held.most, hull.most);
  }
  __device__ bool is_wanted(int tile) const { return !changed || changed[tile] != 0; }
};

/// What all kernels of tiles know.
/// @tparam Shape  the tetrahedra: `LatticeShape` or `MeshShape`. With kDepth, the voxels of a tile along k;
///                `tetrahedron(number)`, `list(tile, its number)` and `rests(voxels, records, thread)`, which a whole
///                thread block calls where a list may rest: whether nothing but tetrahedra at rest owns these voxels,
///                and all are owned
template <class Shape>
struct TileTask {
  Shape shape;
  NudgeTurns turns;
  IntBox box;             ///< voxels that are wanted
  glm::ivec3 origin;      ///< first voxel of the first tile; the nudge turns only between tiles
  glm::ivec3 tiles;       ///< how many on each axis
  glm::ivec3 first_tile;  ///< that reaches the box
  Records records;        ///< of all tetrahedra
  TileCounters* counters;
  KeptTiles kept;

  __device__ int tile_number(const glm::ivec3& tile) const { return (tile.z * tiles.y + tile.y) * tiles.x + tile.x; }
  __device__ void add_covered(int tile, unsigned count) const {
    atomicAdd(&counters->covered, static_cast<unsigned long long>(count));
    if (kept.covered) atomicAdd(&kept.covered[tile], count);
  }
  /// The voxels of the box that a tile has.
  __device__ IntBox voxels(const glm::ivec3& tile) const {
    const glm::ivec3 size(kTileI, kTileJ, Shape::kDepth), first = origin + tile * size;
    return {glm::max(first, box.begin), glm::min(first + size, box.end)};
  }
};

/// Rows of a tile that the tetrahedron in a slot may reach, and how its lines are to be taken.
///
///     31     27   26    25   22 21   20 19   18 17    13 12      8 7      4 3      0
///     +--------+-------+------+-------+-------+--------+---------+--------+--------+
///     |        | Steep | Zone | Upper | Lower |  ZEnd  |  ZBegin |  YEnd  | YBegin |
///     +--------+-------+------+-------+-------+--------+---------+--------+--------+
struct RowSpan {
  int y_begin, y_end, z_begin, z_end;
  int lower, upper, zone;  ///< how many lines there are, and what `shift_lines` says; no lines: nothing is known
  bool is_steep;           ///< whether `steep_faces` must tell

  using YBegin = BitField<0, 4>;
  using YEnd = BitField<YBegin::kEnd, 4>;
  using ZBegin = BitField<YEnd::kEnd, 5>;
  using ZEnd = BitField<ZBegin::kEnd, 5>;
  using Lower = BitField<ZEnd::kEnd, 2>;
  using Upper = BitField<Lower::kEnd, 2>;
  using Zone = BitField<Upper::kEnd, 4>;
  using Steep = BitField<Zone::kEnd, 1>;
  static_assert(kTileJ <= YEnd::kMost && kTileK <= ZEnd::kMost && detail::kMostZone <= Zone::kMost);

  __device__ static RowSpan of(unsigned word) {
    const auto get = [word](auto field) { return static_cast<int>(decltype(field)::get(word)); };
    return {get(YBegin{}), get(YEnd{}),  get(ZBegin{}), get(ZEnd{}),
            get(Lower{}),  get(Upper{}), get(Zone{}),   get(Steep{}) != 0};
  }
  __device__ unsigned word() const {
    return static_cast<unsigned>(YBegin::put(y_begin) | YEnd::put(y_end) | ZBegin::put(z_begin) | ZEnd::put(z_end) |
                                 Lower::put(lower) | Upper::put(upper) | Zone::put(zone) |
                                 Steep::put(is_steep ? 1 : 0));
  }
  __device__ bool has(int y, int z) const { return y >= y_begin && y < y_end && z >= z_begin && z < z_end; }
};

/// Work for a thread: the rows of one y of the tetrahedron in a slot.
///
///     15  12 11    9 8      0
///     +-----+-------+--------+
///     |     |   Y   |  Slot  |
///     +-----+-------+--------+
struct RowItem {
  using Slot = BitField<0, 9>;
  using Y = BitField<Slot::kEnd, 3>;
  static_assert(slots_of(0) <= Slot::kMost && kTileJ <= Y::kMost + 1);

  __device__ static unsigned short of(int slot, int y) {
    return static_cast<unsigned short>(Slot::put(slot) | Y::put(y));
  }
};

/// A row of the tetrahedron in a slot that floats do not tell: `LinesAlongZ::Doubt`, or nothing is known.
///
///     30         29       28   23 22     17 16   10 9        9 8      0
///     +---------+--------+-------+---------+-------+----------+--------+
///     | Unknown | Behind |  End  |  Begin  |  Row  |  Before  |  Slot  |
///     +---------+--------+-------+---------+-------+----------+--------+
struct UnsureRow {
  using Slot = RowItem::Slot;
  using Before = BitField<Slot::kEnd, 1>;
  using Row = BitField<Before::kEnd, 7>;  ///< z * 8 + y
  using Begin = BitField<Row::kEnd, 6>;
  using End = BitField<Begin::kEnd, 6>;
  using Behind = BitField<End::kEnd, 1>;
  using Unknown = BitField<Behind::kEnd, 1>;
  static_assert(kTileRows <= Row::kMost + 1 && kTileI + 1 <= End::kMost && Unknown::kEnd <= 32);

  __device__ static unsigned of(int slot, int row) {
    return static_cast<unsigned>(Slot::put(slot) | Row::put(row)) | Unknown::put(1u);
  }
  __device__ static unsigned of(int slot, int row, const LinesAlongZ::Doubt& doubt) {
    return static_cast<unsigned>(Slot::put(slot) | Row::put(row) | Begin::put(doubt.core.begin) |
                                 End::put(doubt.core.end) | Before::put(doubt.before ? 1 : 0) |
                                 Behind::put(doubt.behind ? 1 : 0));
  }
};

/// Whose an interval is that starts in a row, and where it ends.
///
///     15   14     9 8      0
///     +---+--------+--------+
///     |   |  End   |  Slot  |     Slot: `TileMemory::kNobody` where there is no owner
///     +---+--------+--------+
struct RowOwner {
  using Slot = RowItem::Slot;
  using End = BitField<Slot::kEnd, 6>;
  static_assert(slots_of(0) <= Slot::kMost && kTileI <= End::kMost);

  /// @param end  of which the bits above the field are taken off
  __device__ static unsigned short of(unsigned slot, int end) {
    return static_cast<unsigned short>(Slot::put(slot) | End::put(static_cast<unsigned>(end)));
  }
};

/// The shared memory of a tile of full depth, 38 992 bytes: five fit a multiprocessor, and leave it 60 KiB of L1.
///
///     prepared  385 x 3 x 16   a slot for each tetrahedron: first its lines, from the first voxel of the tile on;
///                              once all rows are marked, its map (`read_maps`); the last for nobody's
///     usable    385 x 4        whether each map may be used
///     numbers   384 x 4        of the tetrahedra, in the order of the list
///     spans     384 x 4        `RowSpan` of each
///     owners    128 x 32 x 2   of row y, z, number z * 8 + y: `RowOwner` where an interval starts
///     starts    128 x 4        a bit where one does
///     items     3072 x 2       `RowItem`: what threads mark; long ones from the front on, short ones from the back.
///                              Where intervals overlap, slots in the order of their numbers
///     unsure    256 x 4        `UnsureRow`, from the front on: what is marked later;
///                              from the back, slots of steep tetrahedra
///
///     voxel     0                   8                   16                        31
///     starts    1 . . . . 1 . .     . . . 1 . . . .     . 1 . . ...                .     an interval starts here
///     owners    a, to 5   b, to 11        nobody, to 17   c, to 32
///
/// So the owner of a voxel stands where the last interval starts that does not start behind it.
template <int kDepth>
struct TileMemory {
  static constexpr int kSlots = slots_of(kDepth), kRows = kTileJ * kDepth;
  static constexpr unsigned kNobody = kSlots;  ///< slot of what has no owner

  float4 prepared[kSlots + 1][kLineQuads];
  unsigned numbers[kSlots];
  unsigned spans[kSlots];
  unsigned starts[kRows];
  unsigned unsure[kMostUnsure];
  unsigned short owners[kRows][kTileI];
  unsigned short items[kSlots * kTileJ];
  unsigned usable[kSlots + 1];
  unsigned long_items, short_items, unsure_count, steep_count;
  unsigned marked, covered;  ///< voxels of all marked intervals; and of those that are found as the rows are read
  bool is_border;            ///< whether voxels may come from the border of the source
  bool is_slow;              ///< whether a map may not be used

  /// The slot that owns a voxel, or kNobody.
  __device__ unsigned owner_of(int row, int x) const {
    return RowOwner::Slot::get(owners[row][last_bit(starts[row] & lowest_bits(x + 1))]);
  }
};
static_assert(kMapQuads == kLineQuads);

/// A thread block at work on a tile.
template <class Shape>
struct IntervalTile {
  using Memory = TileMemory<Shape::kDepth>;

  const TileTask<Shape>& task;
  Memory& memory;
  IntBox voxels;         ///< of the box that the tile has
  glm::ivec3 size;       ///< how many, on each axis
  glm::i32vec3 signs;    ///< nudge of all of them
  const unsigned* list;  ///< of its tetrahedra
  int count;             ///< how many, at most `Memory::kSlots`
  int thread;

  __device__ int lane() const { return thread & 31; }
  __device__ int warp() const { return thread / 32; }
  /// Whether the list of unsure rows was too short, so that not all are marked.
  __device__ bool has_lost_rows() const { return memory.unsure_count + memory.steep_count > kMostUnsure; }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
