// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/coarse_maps.cuh"
#include "cuda/owners/interval_raster.cuh"
#include "cuda/owners/tile.cuh"
#include "cuda/runtime/warp.cuh"

/// A tile of the interval raster: what a thread block knows of it, its shared memory, and the words in it. For
/// interval_raster.cu alone; interval_list.cuh, interval_marks.cuh and interval_sample.cuh are what is done with it, in
/// this order.
namespace tetwarp::cuda_detail {

namespace {

constexpr int kSlots = 256;           ///< tetrahedra whose arithmetic is prepared at a time
constexpr int kMostTetrahedra = 640;  ///< of a tile
constexpr int kMostVertices = 320;    ///< of a tile that are kept at hand
constexpr int kMostUnsure = 256;      ///< intervals for exact integers
constexpr int kBlockCells = 4;        ///< cells of a block along an axis
constexpr int kLowerQuad = 4;         ///< of `TileMemory::prepared`, where faces are: `RowFaces::lower`
constexpr int kQuads = 5;             ///< of a slot
static_assert(kQuads > kLowerQuad && kQuads >= kMapQuads);

/// What all kernels of the interval raster know.
struct TileTask {
  StepLattice lattice;
  NudgeTurns turns;
  IntBox box;         ///< voxels that are wanted
  glm::ivec3 origin;  ///< first voxel of the first tile; the nudge turns only between tiles
  glm::ivec3 tiles;   ///< how many on each axis
  glm::ivec3 blocks;  ///< of cells
  BlockMoves* moves;  ///< of all cells, and then of each block, i fastest: from `moves_kernel`
  TileCells* cells;   ///< of each tile, i fastest: from `cells_kernel`
  IntervalRaster::Counters* counters;

  __device__ int tile_number(const glm::ivec3& tile) const { return (tile.z * tiles.y + tile.y) * tiles.x + tile.x; }
  /// The voxels of the box that a tile has.
  __device__ IntBox voxels(const glm::ivec3& tile) const {
    const glm::ivec3 size(kTileI, kTileJ, kTileK), first = origin + tile * size;
    return {glm::max(first, box.begin), glm::min(first + size, box.end)};
  }
};

/// A tetrahedron of the cells that may reach a tile: the cell, counted from the first of these, and which of its five.
/// Numbers rise as those of the lattice do.
///
///     31      22 21      13 12      3 2     0
///     +---------+----------+---------+-------+
///     |  CellZ  |  CellY   |  CellX  | Which |
///     +---------+----------+---------+-------+
struct TetrahedronInTile {
  using Which = BitField<0, 3>;  ///< 0 to 4: 0 the centre
  using CellX = BitField<Which::kEnd, 10>;
  using CellY = BitField<CellX::kEnd, 9>;
  using CellZ = BitField<CellY::kEnd, 10>;
  static_assert(CellZ::kEnd == 32);

  __device__ static unsigned of(const glm::ivec3& cell, int which) {
    return static_cast<unsigned>(Which::put(which) | CellX::put(cell.x) | CellY::put(cell.y) | CellZ::put(cell.z));
  }
  __device__ static glm::ivec3 cell(unsigned word) { return {CellX::get(word), CellY::get(word), CellZ::get(word)}; }
  __device__ static int which(unsigned word) { return static_cast<int>(Which::get(word)); }
};

/// Cells on each axis that may reach a tile, at most; and of all.
constexpr struct { int x, y, z; } kMostCells{1 << 10, 1 << 9, 1 << 9};
static_assert(kMostCells.x <= TetrahedronInTile::CellX::kMost + 1 &&
              kMostCells.y <= TetrahedronInTile::CellY::kMost + 1 &&
              kMostCells.z <= TetrahedronInTile::CellZ::kMost + 1);
constexpr int kMostCellsInAll = 1 << 18;

/// Rows of a tile that a tetrahedron may reach.
///
///     31           18 17    13 12      8 7      4 3      0
///     +--------------+--------+---------+--------+--------+
///     |   IsSmall    |  ZEnd  |  ZBegin |  YEnd  | YBegin |
///     +--------------+--------+---------+--------+--------+
struct RowSpan {
  int y_begin, y_end, z_begin, z_end;
  bool is_small;  ///< `has_int64_rows`

  using YBegin = BitField<0, 4>;
  using YEnd = BitField<YBegin::kEnd, 4>;
  using ZBegin = BitField<YEnd::kEnd, 5>;
  using ZEnd = BitField<ZBegin::kEnd, 5>;
  using IsSmall = BitField<ZEnd::kEnd, 14>;
  static_assert(IsSmall::kEnd == 32 && kTileJ <= YEnd::kMost && kTileK <= ZEnd::kMost);

  __device__ static RowSpan of(unsigned word) {
    return {static_cast<int>(YBegin::get(word)), static_cast<int>(YEnd::get(word)), static_cast<int>(ZBegin::get(word)),
            static_cast<int>(ZEnd::get(word)), IsSmall::get(word) != 0};
  }
  __device__ unsigned word() const {
    return static_cast<unsigned>(YBegin::put(y_begin) | YEnd::put(y_end) | ZBegin::put(z_begin) | ZEnd::put(z_end) |
                                 IsSmall::put(is_small ? 1 : 0));
  }
};

/// Work for a thread: the rows of one y of the tetrahedron in a slot.
///
///     15     8 7      0
///     +-------+--------+
///     |   Y   |  Slot  |
///     +-------+--------+
struct RowItem {
  using Slot = BitField<0, 8>;
  using Y = BitField<Slot::kEnd, 8>;
  static_assert(Y::kEnd == 16 && kSlots == Slot::kMost + 1);

  __device__ static unsigned short of(int slot, int y) {
    return static_cast<unsigned short>(Slot::put(slot) | Y::put(y));
  }
};

/// A row of the tetrahedron of an entry for which float cannot tell the interval.
///
///     31         16 15     8 7      0
///     +------------+--------+--------+
///     |   Entry    |   Z    |   Y    |
///     +------------+--------+--------+
struct UnsureRow {
  using Y = BitField<0, 8>;
  using Z = BitField<Y::kEnd, 8>;
  using Entry = BitField<Z::kEnd, 16>;
  static_assert(Entry::kEnd == 32 && kMostTetrahedra <= Entry::kMost);

  __device__ static unsigned of(unsigned entry, int y, int z) {
    return Entry::put(entry) | static_cast<unsigned>(Z::put(z) | Y::put(y));
  }
};

constexpr unsigned short kNoOwner = 0xFFFF;  ///< an entry that no list has

/// A row of a tile: the intervals that tetrahedra own.
///
///     voxel     0                   8                   16                        31
///     covered   1 1 1 1 1 1 1 1     1 1 1 . . . . .     . 1 1 1 ...                1     has an owner
///     starts    1 . . . . 1 . .     . . . 1 . . . .     . 1 . . ...                .     an interval starts here
///     owner     a         b               -               c                              entry of its tetrahedron;
///                                                                                        -: kNoOwner, nobody's
///
/// So the owner of a voxel stands where the last interval starts that does not start behind it.
struct IntervalRow {
  unsigned short owner[kTileI];  ///< where an interval starts: entry of its tetrahedron among `numbers`, or kNoOwner
  unsigned starts;               ///< a bit where one does
  unsigned covered;              ///< a bit a voxel that has an owner

  /// The owner of a voxel, once all voxels lie in intervals.
  __device__ unsigned owner_of(int x) const { return owner[last_bit(starts & lowest_bits(x + 1))]; }
};

/// The shared memory of a tile, 44 944 bytes, of which four fit a multiprocessor.
///
///     prepared  257 x 5 x 16   a slot for each tetrahedron of a batch: first its four faces, and in the fifth quad how
///                              many of them are lower; once all rows are marked, its map (`put_map`)
///     usable    257 x 4        whether each map is
///     rows      128 x 72       `IntervalRow`, number z * 8 + y
///     numbers   640 x 4        the list: `TetrahedronInTile` of each entry, rising
///     spans     640 x 4        `RowSpan` of each entry
///     items     2048 x 2       `RowItem`: what threads mark
///     unsure    256 x 4        `UnsureRow`: what exact integers mark
///     vertices  320 x 12       where there are no more
///
/// An *entry* is an index of the list, a *slot* an index within its batch of 256: entry = first of the batch + slot.
struct TileMemory {
  float4 prepared[kSlots + 1][kQuads];  ///< faces, and then maps, the last nobody's
  unsigned usable[kSlots + 1];          ///< of each map, whether it is
  IntervalRow rows[kTileRows];
  unsigned numbers[kMostTetrahedra];      ///< `TetrahedronInTile`, rising
  unsigned spans[kMostTetrahedra];        ///< `RowSpan` of each
  unsigned short items[kSlots * kTileJ];  ///< `RowItem`
  unsigned unsure[kMostUnsure];           ///< `UnsureRow`
  glm::i32vec3 vertices[kMostVertices];   ///< of the tile's cells, as `IntervalTile::read_vertex`, i fastest
  unsigned per_warp[kTileJ];
  unsigned count, item_count, unsure_count, settled;
  bool overlaps;  ///< or too many are unsure
};

/// n / size and n % size, for n below 2^21.
struct Divided {
  int quotient, rest;
};
__device__ Divided divided(int n, int size) {
  const int quotient = static_cast<int>((static_cast<float>(n) + 0.5f) * detail::reciprocal(static_cast<float>(size)));
  return {quotient, n - quotient * size};
}

/// Where the vertices of a tetrahedron are among those of the tile's cells.
struct Corners {
  int a, b, c, d;
};

/// A thread block at work on a tile.
struct IntervalTile {
  const TileTask& task;
  TileMemory& memory;
  IntBox voxels;                 ///< of the box that the tile has
  glm::ivec3 size;               ///< how many, on each axis
  glm::i32vec3 signs;            ///< nudge of all of them
  glm::ivec3 first_cell, cells;  ///< those that may reach the tile
  int thread;
  bool at_hand;  ///< whether `memory.vertices` has the vertices of these cells

  __device__ int lane() const { return thread & 31; }
  __device__ int warp() const { return thread / 32; }

  /// Which tetrahedron a number of the list means.
  __device__ LatticeTetrahedron tetrahedron(unsigned number) const {
    return LatticeTetrahedron::of_cell(first_cell + TetrahedronInTile::cell(number), TetrahedronInTile::which(number));
  }

  /// The number of vertices of the tile's cells along an axis.
  __device__ glm::ivec3 vertex_counts() const { return cells + 1; }
  /// Whether there is room for the vertices of so many cells on each axis.
  __device__ static bool has_room(const glm::ivec3& cells) {
    const glm::ivec3 counts = cells + 1;
    return counts.x * counts.y * counts.z <= kMostVertices;
  }
  /// From the first voxel of the tile to a deformed vertex, 2^-12 voxel.
  __device__ glm::i32vec3 read_vertex(int n) const {
    const glm::ivec3 counts = vertex_counts();
    const Divided row = divided(n, counts.x), slice = divided(row.quotient, counts.y);
    return task.lattice.deformed(first_cell + glm::ivec3(row.rest, slice.rest, slice.quotient)) -
           voxels.begin * kStepsPerVoxel;
  }
  __device__ glm::i32vec3 vertex(int n) const { return at_hand ? memory.vertices[n] : read_vertex(n); }
  __device__ void read_vertices() const {
    const glm::ivec3 counts = vertex_counts();
    const int count = counts.x * counts.y * counts.z;
#pragma unroll 1
    for (int n = thread; n < count; n += kTileThreads) memory.vertices[n] = read_vertex(n);
  }
  /// The corners of a tetrahedron of the list, as `tetrahedron_corners`.
  __device__ Corners corners(unsigned number) const {
    constexpr int kDOfEven = 0x65307, kDOfOdd = 0x74210;  // corner D of each of the five, from the lowest digit on
    const glm::ivec3 counts = vertex_counts(), cell(TetrahedronInTile::cell(number));
    const unsigned which = TetrahedronInTile::Which::get(number);
    const bool centre = which == 0,
               odd = ((first_cell.x + cell.x + first_cell.y + cell.y + first_cell.z + cell.z) & 1) != 0;
    const int corner = (odd ? kDOfOdd : kDOfEven) >> (4 * which) & 7;
    const int x = (corner & 1) != 0 ? -1 : 1, y = (corner & 2) != 0 ? -counts.x : counts.x,
              z = ((corner & 4) != 0 ? -counts.x : counts.x) * counts.y;
    const int d =
        ((cell.z + (corner >> 2)) * counts.y + (cell.y + (corner >> 1 & 1))) * counts.x + cell.x + (corner & 1);
    const int all = d + x + y + z;  // across the cell
    return centre ? Corners{all - x, all - y, all - z, d} : Corners{d + x, d + y, d + z, d};
  }

  /// Where the faces of the tetrahedron in a slot cross the rows.
  __device__ RowFaces faces_of(int slot) const {
    const float4* const quads = memory.prepared[slot];
    return faces_in_quads(quads, __float_as_int(quads[kLowerQuad].x));
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
