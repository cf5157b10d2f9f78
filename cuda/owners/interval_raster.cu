// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/interval_raster.cuh"

#include <algorithm>
#include <limits>

#include "cuda/output/voxel_sink.cuh"
#include "cuda/output/weighing.cuh"
#include "cuda/owners/gather.cuh"
#include "cuda/runtime/warp.cuh"
#include "deform/core/row_interval.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kTileI = 32, kTileJ = 8, kTileK = 16;  ///< voxels of a tile
constexpr int kTileRows = kTileJ * kTileK;
constexpr int kTileThreads = 32 * kTileJ;  ///< a warp a column of rows
constexpr int kTileBlocks = 4;             ///< a multiprocessor
constexpr int kSlots = 256;                ///< tetrahedra whose arithmetic is prepared at a time
constexpr int kMostTetrahedra = 640;       ///< of a tile
constexpr int kMostVertices = 320;         ///< of a tile that are kept at hand
constexpr int kMostUnsure = 256;           ///< intervals for exact integers
constexpr int kBlockCells = 4;             ///< cells of a block along an axis
static_assert(kTileI <= kMostRowTile && kTileJ <= kMostRowTile && kTileK <= kMostRowTile);

/// What all kernels know.
struct TileTask {
  StepLattice lattice;
  NudgeTurns turns;
  IntBox box;
  glm::ivec3 origin;  ///< first voxel of the first tile; the nudge turns only between tiles
  glm::ivec3 tiles;   ///< how many on each axis
  glm::ivec3 blocks;  ///< of cells
  BlockMoves* moves;  ///< of all cells, and then of each block, i fastest
  TileCells* cells;   ///< of each tile, i fastest
  IntervalRaster::Counters* counters;

  __device__ int tile_number(const glm::ivec3& tile) const { return (tile.z * tiles.y + tile.y) * tiles.x + tile.x; }
  /// The voxels of the box that a tile has.
  __device__ IntBox voxels(const glm::ivec3& tile) const {
    const glm::ivec3 size(kTileI, kTileJ, kTileK), first = origin + tile * size;
    return {glm::max(first, box.begin), glm::min(first + size, box.end)};
  }
};

/// One warp a block of cells: how far its vertices are displaced.
__global__ void moves_kernel(TileTask task) {
  constexpr int kSide = kBlockCells + 1;
  const int number = static_cast<int>((blockIdx.x * kThreads + threadIdx.x) / 32);
  if (number >= task.blocks.x * task.blocks.y * task.blocks.z) return;
  const StepLattice& lattice = task.lattice;
  const glm::ivec3 first = kBlockCells * glm::ivec3(number % task.blocks.x, number / task.blocks.x % task.blocks.y,
                                                    number / (task.blocks.x * task.blocks.y));
  Box moves{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  for (int n = static_cast<int>(threadIdx.x & 31); n < kSide * kSide * kSide; n += 32) {
    const glm::ivec3 vertex =
        glm::min(first + glm::ivec3(n % kSide, n / kSide % kSide, n / (kSide * kSide)), lattice.cells);
    moves.grow(glm::i32vec3(lattice.moved(lattice.offset(vertex))));
  }
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    moves.low[axis] = warp_min(moves.low[axis]);
    moves.high[axis] = warp_max(moves.high[axis]);
  }
  if ((threadIdx.x & 31) != 0) return;
  task.moves[1 + number] = {moves.low, moves.high};
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    if (moves.low[axis] < task.moves[0].low[axis]) atomicMin(&task.moves[0].low[axis], moves.low[axis]);
    if (moves.high[axis] > task.moves[0].high[axis]) atomicMax(&task.moves[0].high[axis], moves.high[axis]);
  }
}

/// One warp a tile: the cells that may reach it, as a box of cells.
__global__ void cells_kernel(TileTask task) {
  const int number = static_cast<int>((blockIdx.x * kThreads + threadIdx.x) / 32);
  if (number >= task.tiles.x * task.tiles.y * task.tiles.z) return;
  const StepLattice& lattice = task.lattice;
  const IntBox voxels = task.voxels(
      {number % task.tiles.x, number / task.tiles.x % task.tiles.y, number / (task.tiles.x * task.tiles.y)});
  const glm::ivec3 cell(lattice.cell);
  const glm::ivec3 low = voxels.begin * kStepsPerVoxel - glm::ivec3(lattice.first),
                   high = (voxels.end - 1) * kStepsPerVoxel - glm::ivec3(lattice.first);  // nudged by less than a step
  constexpr float kBeyond = 1.0f / 32;  // cells: more than the nudge and what rounding costs
  /// Cells of [from, to] that may reach the tile where vertices move like that.
  const auto cells_of = [&](const BlockMoves& moves, glm::ivec3& from, glm::ivec3& to) {
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
  };
  glm::ivec3 from(0), to = lattice.cells - 1;
  Box found{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)}, moved = found;
  if (cells_of(task.moves[0], from, to)) {
    const glm::ivec3 first = from / kBlockCells, size = to / kBlockCells - first + 1;
    for (int n = static_cast<int>(threadIdx.x & 31); n < size.x * size.y * size.z; n += 32) {
      const glm::ivec3 block = first + glm::ivec3(n % size.x, n / size.x % size.y, n / (size.x * size.y));
      const BlockMoves moves = task.moves[1 + (block.z * task.blocks.y + block.y) * task.blocks.x + block.x];
      glm::ivec3 first_cell = block * kBlockCells, last_cell = glm::min(first_cell + kBlockCells, lattice.cells) - 1;
      if (!cells_of(moves, first_cell, last_cell)) continue;
      found.grow(first_cell);
      found.grow(last_cell);
      moved.grow(moves.low);
      moved.grow(moves.high);
    }
  }
  bool inside = true;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    found.low[axis] = warp_min(found.low[axis]);
    found.high[axis] = warp_max(found.high[axis]);
    moved.low[axis] = warp_min(moved.low[axis]);
    moved.high[axis] = warp_max(moved.high[axis]);
    inside &= low[axis] >= 0 && high[axis] <= lattice.cells[axis] * cell[axis];
  }
  if ((threadIdx.x & 31) != 0) return;
  const bool any = found.low.x <= found.high.x,
             rests = moved.low == glm::i32vec3(0) && moved.high == glm::i32vec3(0) && inside && any;
  TileCells& cells = task.cells[number];
  cells = {any ? found.low : glm::ivec3(0), any ? found.high - found.low + 1 : glm::ivec3(0), {}, {}, rests, 0};
  if (!any) return;
  // Weights are at least -1/64, and wrong by less than 1/256: three move a voxel by less than 1/16 of the range.
  const glm::ivec3 beyond = (moved.high - moved.low) / 16 + kStepsPerVoxel;
  cells.source_begin = (voxels.begin * kStepsPerVoxel - (moved.high + beyond)) >> kStepBits;
  cells.source_end = ((voxels.end * kStepsPerVoxel - (moved.low - beyond)) >> kStepBits) + 1;
}

/// A row of a tile.
struct Row {
  unsigned short owner[kTileI];  ///< where an interval starts: place of its tetrahedron among `numbers`, or kNoOwner
  unsigned starts;               ///< a bit where one does
  unsigned covered;              ///< a bit a voxel that has an owner

  /// The owner of a voxel, once all voxels lie in intervals.
  __device__ unsigned owner_of(int x) const { return owner[31 - __clz(static_cast<int>(starts & ~0u >> (31 - x)))]; }
};

/// The shared memory of a tile.
struct TileMemory {
  float4 prepared[kSlots + 1][kQuads];  ///< faces, and then `Weighing`, the last nobody's
  float ends[kSlots + 1];               ///< the last float of each `Weighing`
  Row rows[kTileRows];
  unsigned numbers[kMostTetrahedra];      ///< in the order of their numbers: `TileWorker::number_of`
  unsigned spans[kMostTetrahedra];        ///< `Span` of each
  unsigned short items[kSlots * kTileJ];  ///< rows of one y of a tetrahedron
  unsigned unsure[kMostUnsure];
  glm::i32vec3 vertices[kMostVertices];  ///< of the tile's cells, as `TileWorker::read_vertex`, i fastest
  unsigned per_warp[kTileJ];
  unsigned count, item_count, unsure_count, settled;
  bool overlaps;  ///< or too many are unsure
};

/// Cells on each axis that may reach a tile, at most; powers of two. And of all.
constexpr struct { int x, y, z; } kMostCells{1 << 10, 1 << 9, 1 << 9};
constexpr int kMostCellsInAll = 1 << 18;

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

constexpr unsigned short kNoOwner = 0xFFFF;

/// Rows of a tile that a tetrahedron may reach, in one word.
struct Span {
  int y_begin, y_end, z_begin, z_end;
  bool is_small;  ///< `has_int64_rows`

  __device__ static Span of(unsigned word) {
    return {static_cast<int>(word & 15), static_cast<int>(word >> 4 & 15), static_cast<int>(word >> 8 & 31),
            static_cast<int>(word >> 13 & 31), word >> 18 != 0};
  }
  __device__ unsigned word() const {
    return static_cast<unsigned>(y_begin | y_end << 4 | z_begin << 8 | z_end << 13 | (is_small ? 1 << 18 : 0));
  }
};

/// Rarely called, so out of line, with everything by value.
__device__ __noinline__ RowInterval exactly(const TileTask& task, LatticeTetrahedron t, glm::ivec3 first,
                                            glm::i32vec3 signs, int y, int z, int count) {
  return exact_row(vertices_of(task.lattice, t), first, signs, y, z, count);
}

/// A voxel whose weights are not for float; likewise.
template <class Sink>
__device__ __noinline__ bool write_slowly(const TileTask& task, const Sink& sink, LatticeTetrahedron t, int out,
                                          glm::ivec3 at, glm::i32vec3 signs) {
  return sink.write(out, at, offset_in(task.lattice, t, at, signs));
}

/// A thread block at work on a tile.
template <class Sink>
struct TileWorker {
  const TileTask& task;
  const Sink& sink;
  TileMemory& memory;
  IntBox voxels;
  glm::ivec3 size;
  glm::i32vec3 signs;
  glm::ivec3 first_cell, cells;
  int thread;

  /// Which tetrahedron a number of the list means.
  __device__ static glm::ivec3 cell_of(unsigned number) {
    return {number >> 3 & (kMostCells.x - 1), number >> 13 & (kMostCells.y - 1), number >> 22};
  }
  __device__ LatticeTetrahedron tetrahedron(unsigned number) const {
    return LatticeTetrahedron::of_cell(first_cell + cell_of(number), static_cast<int>(number & 7));
  }
  __device__ static unsigned number_of(const glm::ivec3& cell, int t) {
    return static_cast<unsigned>(t | cell.x << 3 | cell.y << 13 | cell.z << 22);
  }

  /// A tile at rest is copied.
  __device__ void copy() const {
    constexpr int kAtOnce = 8;
    const int lane = thread & 31, y = thread / 32;
    if (lane >= size.x || y >= size.y) return;
    const glm::ivec3 at = voxels.begin + glm::ivec3(lane, y, 0);
    for (int z = 0; z < size.z; z += kAtOnce)
      sink.template copy<kAtOnce>(at + glm::ivec3(0, 0, z), ~0u >> max(32 - (size.z - z), 0));
  }

  /// The number of vertices of the tile's cells along an axis.
  __device__ glm::ivec3 vertex_counts() const { return cells + 1; }
  /// Whether the vertices of all cells are at hand.
  __device__ bool has_vertices() const {
    const glm::ivec3 counts = vertex_counts();
    return counts.x * counts.y * counts.z <= kMostVertices;
  }
  /// From the first voxel of the tile to a deformed vertex, 2^-12 voxel.
  __device__ glm::i32vec3 read_vertex(int n) const {
    const glm::ivec3 counts = vertex_counts();
    const Divided row = divided(n, counts.x), slice = divided(row.quotient, counts.y);
    return task.lattice.deformed(first_cell + glm::ivec3(row.rest, slice.rest, slice.quotient)) -
           voxels.begin * kStepsPerVoxel;
  }
  __device__ glm::i32vec3 vertex(int n, bool at_hand) const { return at_hand ? memory.vertices[n] : read_vertex(n); }
  __device__ void read_vertices() const {
    const glm::ivec3 counts = vertex_counts();
    const int count = counts.x * counts.y * counts.z;
#pragma unroll 1
    for (int n = thread; n < count; n += kTileThreads) memory.vertices[n] = read_vertex(n);
  }
  /// The corners of a tetrahedron of the list, as `tetrahedron_corners`.
  __device__ Corners corners(unsigned number) const {
    const glm::ivec3 counts = vertex_counts(), cell(cell_of(number));
    const bool centre = (number & 7) == 0,
               odd = ((first_cell.x + cell.x + first_cell.y + cell.y + first_cell.z + cell.z) & 1) != 0;
    const int corner = (odd ? 0x74210 : 0x65307) >> (4 * (number & 7)) & 7;
    const int x = (corner & 1) != 0 ? -1 : 1, y = (corner & 2) != 0 ? -counts.x : counts.x,
              z = ((corner & 4) != 0 ? -counts.x : counts.x) * counts.y;
    const int d =
        ((cell.z + (corner >> 2)) * counts.y + (cell.y + (corner >> 1 & 1))) * counts.x + cell.x + (corner & 1);
    const int all = d + x + y + z;  // across the cell
    return centre ? Corners{all - x, all - y, all - z, d} : Corners{d + x, d + y, d + z, d};
  }

  /// Whether a tetrahedron may own voxels of the tile.
  __device__ bool may_own(unsigned number, bool at_hand, Span& span) const {
    const Corners at = corners(number);
    const glm::i32vec3 d = vertex(at.d, at_hand);
    Box box{d, d};
    box.grow(vertex(at.a, at_hand));
    box.grow(vertex(at.b, at_hand));
    box.grow(vertex(at.c, at_hand));
    IntBox own{glm::ivec3(0), size};
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {  // as `cut_to_candidates`, where all voxels are nudged alike
      const int low = box.low[axis] - (signs[axis] > 0 ? 1 : 0), high = box.high[axis] - (signs[axis] > 0 ? 1 : 0);
      own.begin[axis] = max(own.begin[axis], (low >> kStepBits) + 1);
      own.end[axis] = min(own.end[axis], (high >> kStepBits) + 1);
    }
    span = {own.begin.y, own.end.y, own.begin.z, own.end.z, fits_int64(box)};
    return !own.is_empty();
  }

  /// Lists the tetrahedra that may own voxels of the tile, in rising order. @return whether there is room for them
  __device__ bool list(bool at_hand) const {
    if (cells.x > kMostCells.x || cells.y > kMostCells.y || cells.z > kMostCells.z) return false;
    if (cells.x * cells.y * cells.z > kMostCellsInAll) return false;
    const int total = cells.x * cells.y * cells.z * kTetrahedraPerCell, lane = thread & 31, warp = thread / 32;
    unsigned listed = 0;
#pragma unroll 1
    for (int from = 0; from < total; from += kTileThreads) {
      const int n = from + thread, cell = n / kTetrahedraPerCell;
      const Divided row = divided(cell, cells.x), slice = divided(row.quotient, cells.y);
      const unsigned number = number_of({row.rest, slice.rest, slice.quotient}, n % kTetrahedraPerCell);
      Span span{};
      const bool reaches = n < total && may_own(number, at_hand, span);
      const unsigned votes = __ballot_sync(~0u, reaches);
      if (lane == 0) memory.per_warp[warp] = static_cast<unsigned>(__popc(votes));
      __syncthreads();
      unsigned place = listed + static_cast<unsigned>(__popc(votes & ((1u << lane) - 1)));
      for (int w = 0; w < kTileJ; ++w) {
        if (w < warp) place += memory.per_warp[w];
        listed += memory.per_warp[w];
      }
      if (reaches && place < kMostTetrahedra) {
        memory.numbers[place] = number;
        memory.spans[place] = span.word();
      }
      __syncthreads();
      if (listed > kMostTetrahedra) return false;
    }
    if (thread == 0) memory.count = listed;
    __syncthreads();
    return true;
  }

  /// The faces of a tetrahedron; then its rows.
  __device__ void set_faces(int slot, unsigned place, bool at_hand) const {
    constexpr float kUnsure = 1e9f;  // the error of what is not for float
    Span span = Span::of(memory.spans[place]);
    float4* faces = memory.prepared[slot];
    int lower = 0;
    if (span.is_small) {
      const Corners at = corners(memory.numbers[place]);
      const glm::i32vec3 d = vertex(at.d, at_hand), a = vertex(at.a, at_hand) - d, b = vertex(at.b, at_hand) - d,
                         c = vertex(at.c, at_hand) - d;
      lower = make_row_faces(a, b, c, d, signs, size, [faces](int n, const RowFace& face) {
        faces[n] = make_float4(face.at, face.along_y, face.along_z, face.error);
      });
      if (lower == 0 && detail::edge_determinant(a, b, c) == 0) {  // owns nothing
        span.y_end = span.y_begin;
        memory.spans[place] = span.word();
      }
    }
    if (lower == 0) {  // exact integers must say
      lower = 2;
#pragma unroll
      for (int n = 0; n < 4; ++n) faces[n] = make_float4(0, 0, 0, kUnsure);
    }
    faces[4].x = __int_as_float(lower);
    unsigned item = atomicAdd(&memory.item_count, static_cast<unsigned>(span.y_end - span.y_begin));
#pragma unroll 1
    for (int y = span.y_begin; y < span.y_end; ++y) memory.items[item++] = static_cast<unsigned short>(slot | y << 8);
  }

  __device__ RowFaces faces_of(int slot) const {
    RowFaces t;
#pragma unroll
    for (int n = 0; n < 4; ++n) {
      const float4 face = memory.prepared[slot][n];
      t.faces[n] = {face.x, face.y, face.z, face.w};
    }
    t.lower = __float_as_int(memory.prepared[slot][4].x);
    return t;
  }

  __device__ RowInterval exact(unsigned place, int y, int z) const {
    return exactly(task, tetrahedron(memory.numbers[place]), voxels.begin, signs, y, z, size.x);
  }
  __device__ static unsigned bits_of(const RowInterval& in) { return ~0u >> (32 - (in.end - in.begin)) << in.begin; }

  __device__ void mark(const RowInterval& in, Row& row, unsigned place) const {
    if (in.is_empty()) return;
    const unsigned bits = bits_of(in);
    if ((atomicOr(&row.covered, bits) & bits) != 0) {  // then this tile is done again
      memory.overlaps = true;
      return;
    }
    atomicOr(&row.starts, 1u << in.begin);
    row.owner[in.begin] = static_cast<unsigned short>(place);
  }

  /// Marks where the intervals of a tetrahedron's rows of one y start.
  __device__ void mark_item(unsigned batch, unsigned item) const {
    const int slot = static_cast<int>(item & 255), y = static_cast<int>(item >> 8);
    const unsigned place = batch + static_cast<unsigned>(slot);
    const Span span = Span::of(memory.spans[place]);
    const RowsAlongZ rows(faces_of(slot), y);
    Row* row = &memory.rows[span.z_begin * kTileJ + y];
#pragma unroll 1
    for (int z = span.z_begin; z < span.z_end; ++z, row += kTileJ) {
      bool is_certain = false;
      const RowInterval in = rows.interval(z, size.x, is_certain);
      if (is_certain) {
        mark(in, *row, place);
      } else {  // later: calls would cost this loop registers
        const unsigned at = atomicAdd(&memory.unsure_count, 1u);
        if (at < kMostUnsure) memory.unsure[at] = place << 16 | static_cast<unsigned>(z << 8 | y);
      }
    }
  }
  /// Likewise of all, an item a thread.
  __device__ void mark_all(unsigned batch) const {
    const unsigned items = memory.item_count;
#pragma unroll 1
    for (unsigned from = static_cast<unsigned>(thread & ~31); from < items; from += kTileThreads) {
      const unsigned n = from + static_cast<unsigned>(thread & 31);
      if (n < items) mark_item(batch, memory.items[n]);
      __syncwarp();  // else lanes go on by themselves
    }
    __syncthreads();
    const unsigned unsure = memory.unsure_count;
    if (unsure > kMostUnsure) memory.overlaps = true;
#pragma unroll 1
    for (unsigned n = static_cast<unsigned>(thread); n < min(unsure, static_cast<unsigned>(kMostUnsure));
         n += kTileThreads) {
      const unsigned place = memory.unsure[n] >> 16;
      const int z = memory.unsure[n] >> 8 & 255, y = memory.unsure[n] & 255;
      mark(exact(place, y, z), memory.rows[z * kTileJ + y], place);
    }
  }

  /// Where intervals overlap: a thread a row, tetrahedron after tetrahedron; who comes first has the voxel.
  __device__ void mark_in_order(unsigned batch, unsigned slots) const {
    if (thread >= kTileRows) return;
    const int y = thread % kTileJ, z = thread / kTileJ;
    Row& row = memory.rows[thread];
    unsigned covered = row.covered;
#pragma unroll 1
    for (int slot = 0; slot < static_cast<int>(slots); ++slot) {
      const unsigned place = batch + static_cast<unsigned>(slot);
      const Span span = Span::of(memory.spans[place]);
      if (y < span.y_begin || y >= span.y_end || z < span.z_begin || z >= span.z_end) continue;
      bool is_certain = false;
      RowInterval in = RowsAlongZ(faces_of(slot), y).interval(z, size.x, is_certain);
      if (!is_certain) in = exact(place, y, z);
      if (in.is_empty()) continue;
      const unsigned bits = bits_of(in);
      for (unsigned left = bits & ~covered; left != 0; left &= left - 1)
        row.owner[__ffs(static_cast<int>(left)) - 1] = static_cast<unsigned short>(place);
      covered |= bits;
    }
    row.covered = row.starts = covered;
  }

  __device__ void clear() const {
    if (thread < kTileRows) memory.rows[thread].starts = memory.rows[thread].covered = 0;
    if (thread == 0) {
      memory.prepared[kSlots][0] = make_float4(0, 0, 0, kNoNumber);
      memory.overlaps = false;
      memory.item_count = memory.unsure_count = 0;
    }
  }

  /// Where nobody owns, an interval of nobody's starts.
  __device__ void mark_holes() const {
    if (thread >= kTileRows) return;
    Row& row = memory.rows[thread];
    const unsigned holes = ~row.covered, starts = holes & ~(holes << 1);
    for (unsigned left = starts; left != 0; left &= left - 1) row.owner[__ffs(static_cast<int>(left)) - 1] = kNoOwner;
    row.starts |= starts;
  }

  /// All tetrahedra, as many at a time as there is room for.
  __device__ void rasterise(bool in_order, bool at_hand) const {
    const unsigned count = memory.count;
    for (unsigned batch = 0; batch < count; batch += kSlots) {
      const unsigned slots = min(count - batch, static_cast<unsigned>(kSlots));
      __syncthreads();
      static_assert(kSlots <= kTileThreads);
      if (thread < static_cast<int>(slots)) set_faces(thread, batch + static_cast<unsigned>(thread), at_hand);
      __syncthreads();
      if (in_order) {
        mark_in_order(batch, slots);
      } else {
        mark_all(batch);
      }
      __syncthreads();
      if (thread == 0) memory.item_count = memory.unsure_count = 0;
    }
    __syncthreads();
  }

  /// What the voxels of the first tetrahedra need.
  __device__ void weigh(bool at_hand) const {
    if (thread >= static_cast<int>(min(memory.count, static_cast<unsigned>(kSlots)))) return;
    const StepLattice& lattice = task.lattice;
    const unsigned number = memory.numbers[thread];
    const LatticeTetrahedron t = tetrahedron(number);
    const Corners at = corners(number);
    // What `LocalTetrahedron` has; all numbers are whole and exact.
    const glm::i32vec3 d = vertex(at.d, at_hand), cell(lattice.cell), edge = t.direction() * cell;
    const glm::i32vec3 rest = glm::i32vec3(lattice.first) + t.d * cell - voxels.begin * kStepsPerVoxel;
    const glm::vec3 moved(d - rest);
    const auto vertex_at = [&](int corner, int axis, glm::vec3& moved_further) {
      const glm::i32vec3 to = vertex(corner, at_hand) - d;
      glm::i32vec3 further = to;
#pragma unroll
      for (int k = 0; k < 3; ++k)
        if ((k == axis) != t.centre) further[k] -= edge[k];
      moved_further = further;
      return glm::vec3(to);
    };
    glm::vec3 moved_a, moved_b, moved_c;
    const glm::vec3 a = vertex_at(at.a, 0, moved_a), b = vertex_at(at.b, 1, moved_b), c = vertex_at(at.c, 2, moved_c);
    prepare_weighing(a, b, c, glm::vec3(-d), {moved, moved_a, moved_b, moved_c}, memory.prepared[thread],
                     memory.ends[thread]);
  }

  /// The voxels of one lane: a column along k. @tparam kInside  whether all come from well inside the source
  /// @return how many are covered
  template <bool kInside>
  __device__ unsigned sample() const {
    const int lane = thread & 31, y = thread / 32;
    if (lane >= size.x || y >= size.y) return 0;
    const Row* row = &memory.rows[y];
    const unsigned up_to_lane = ~0u >> (31 - lane);
    const auto next_place = [&]() -> unsigned {
      const Row& of = *row;
      row += kTileJ;
      return of.owner[31 - __clz(static_cast<int>(of.starts & up_to_lane))];
    };
    return sample_column<kInside>(sink, weighings(), voxels.begin + glm::ivec3(lane, y, 0),
                                  glm::vec3(lane * kStepsPerVoxel, y * kStepsPerVoxel, 0), size.z, next_place,
                                  [&](int z) { return finish(lane, y, z); });
  }
  __device__ Weighings weighings() const { return {memory.prepared, memory.ends, kSlots}; }
  /// A voxel that `sample` has not written. @return whether it is covered
  __device__ bool finish(int x, int y, int z) const {
    const glm::ivec3 in_tile(x, y, z), at = voxels.begin + in_tile;
    const unsigned place = memory.rows[z * kTileJ + y].owner_of(x);
    if (place == kNoOwner) {
      sink.nothing(sink.place(at));
      return false;
    }
    return finish_voxel(sink, weighings(), place, at, glm::vec3(in_tile * kStepsPerVoxel), [&](int out) {
      return write_slowly(task, sink, tetrahedron(memory.numbers[place]), out, at, signs);
    });
  }
};

template <class Sink>
__global__ void __launch_bounds__(kTileThreads, Sink::kIsWide ? kTileBlocks - 1 : kTileBlocks)
    tile_kernel(const __grid_constant__ TileTask task, const __grid_constant__ Sink sink) {
  __shared__ TileMemory memory;
  const glm::ivec3 tile(blockIdx.x, blockIdx.y, blockIdx.z);
  const IntBox voxels = task.voxels(tile);
  TileCells& cells = task.cells[task.tile_number(tile)];
  const int thread = static_cast<int>(threadIdx.x);
  const TileWorker<Sink> worker{
      task,        sink,       memory, voxels, voxels.end - voxels.begin, task.turns.signs(voxels.begin),
      cells.first, cells.size, thread};
  if (cells.rests) {
    worker.copy();
    if (thread == 0)
      atomicAdd(&task.counters->covered,
                static_cast<unsigned long long>(worker.size.x * worker.size.y * worker.size.z));
    return;
  }
  if (thread == 0) memory.settled = 0;
  worker.clear();
  const bool at_hand = worker.has_vertices();
  if (at_hand) worker.read_vertices();
  __syncthreads();
  if (!worker.list(at_hand)) {
    if (thread == 0) {
      cells.left = 1;
      atomicAdd(&task.counters->left, 1u);
    }
    return;
  }
#pragma unroll 1
  for (int n = 0; n < 2; ++n) {
    worker.rasterise(n != 0, at_hand);
    if (!memory.overlaps) break;
    __syncthreads();
    worker.clear();
  }
  worker.mark_holes();
  worker.weigh(at_hand);
  __syncthreads();
  const bool inside = sink.surrounds(cells.source_begin, cells.source_end);
  // `group_sum`, not CUB's sum: that saves 8 instructions, but takes 88 more in the kernel for volumes of any types.
  const unsigned covered = group_sum(inside ? worker.template sample<true>() : worker.template sample<false>(), 32);
  if ((thread & 31) == 0) atomicAdd(&memory.settled, covered);
  __syncthreads();
  if (thread == 0 && memory.settled != 0)
    atomicAdd(&task.counters->covered, static_cast<unsigned long long>(memory.settled));
}

/// A thread a row of a tile.
__global__ void mark_left_kernel(TileTask task, std::uint32_t* several) {
  const int number = static_cast<int>(blockIdx.x);
  if (!task.cells[number].left) return;
  const IntBox voxels = task.voxels(
      {number % task.tiles.x, number / task.tiles.x % task.tiles.y, number / (task.tiles.x * task.tiles.y)});
  const glm::ivec3 size = voxels.end - voxels.begin, of_box = task.box.end - task.box.begin;
  const int y = static_cast<int>(threadIdx.x) % kTileJ, z = static_cast<int>(threadIdx.x) / kTileJ;
  if (y >= size.y || z >= size.z) return;
  const glm::ivec3 first = voxels.begin - task.box.begin;
  const std::int64_t row = (std::int64_t{first.z + z} * of_box.y + first.y + y) * ((of_box.x + 31) / 32);
  const int last = first.x + size.x - 1;
  for (int word = first.x / 32; word <= last / 32; ++word)
    atomicOr(&several[row + word], bits_of_word(word, first.x, last));
}

TileTask make_task(const DeviceField& field, const SlabBox& box) {
  TileTask task{};
  task.lattice = field.steps;
  task.turns = NudgeTurns(field.frame.nudge);
  task.box = {glm::ivec3(box.begin), glm::ivec3(box.begin + box.size)};
  task.blocks = (field.steps.cells + kBlockCells - 1) / kBlockCells;
  const glm::ivec3 size(kTileI, kTileJ, kTileK);
  for (int axis = 0; axis < 3; ++axis) {
    task.origin[axis] = static_cast<int>(
        tile_origin(task.box.begin[axis], task.box.end[axis], task.turns.first_down[axis], size[axis]));
    task.tiles[axis] = (task.box.end[axis] - task.origin[axis] + size[axis] - 1) / size[axis];
  }
  return task;
}

}  // namespace

bool IntervalRaster::suits(const StepLattice& lattice, bool is_folded) {
  const float kLeast = (is_folded ? 5 : 8) * kStepsPerVoxel, kMost = 40 * kStepsPerVoxel;
  const glm::vec3& cell = lattice.cell;
  return std::min({cell.x, cell.y, cell.z}) >= kLeast && std::max({cell.x, cell.y, cell.z}) <= kMost;
}

template <class Sink>
void IntervalRaster::run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream) {
  TileTask task = make_task(lattice.field(), box);
  counters_.fill(0, 1, stream);
  const std::int64_t blocks = std::int64_t{task.blocks.x} * task.blocks.y * task.blocks.z,
                     tiles = std::int64_t{task.tiles.x} * task.tiles.y * task.tiles.z;
  task.moves = moves_.reserve(static_cast<std::size_t>(blocks + 1));
  task.cells = cells_.reserve(static_cast<std::size_t>(tiles));
  task.counters = counters_.data();
  if (!has_moves_) {
    moves_.fill(0, 1, stream);  // the least box that holds no move at all: it only grows
    moves_kernel<<<blocks_for(blocks * 32), kThreads, 0, stream>>>(task);
    has_moves_ = true;
  }
  cells_kernel<<<blocks_for(tiles * 32), kThreads, 0, stream>>>(task);
  const dim3 grid(static_cast<unsigned>(task.tiles.x), static_cast<unsigned>(task.tiles.y),
                  static_cast<unsigned>(task.tiles.z));
  tile_kernel<<<grid, kTileThreads, 0, stream>>>(task, sink);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

IntervalRaster::Counters IntervalRaster::counters(cudaStream_t stream) {
  Counters* found = found_.reserve(1);
  TETWARP_CUDA_TRY(cudaMemcpyAsync(found, counters_.data(), sizeof *found, cudaMemcpyDeviceToHost, stream));
  TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  return *found;
}

void IntervalRaster::mark_left(const LatticeOnDevice& lattice, const SlabBox& box, std::uint32_t* several,
                               cudaStream_t stream) const {
  TileTask task = make_task(lattice.field(), box);
  task.cells = cells_.data();
  mark_left_kernel<<<static_cast<unsigned>(task.tiles.x * task.tiles.y * task.tiles.z), kTileRows, 0, stream>>>(
      task, several);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const OffsetSink&, cudaStream_t);
template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const VolumesSink<void>&, cudaStream_t);
template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const VolumesSink<std::int16_t>&,
                                  cudaStream_t);
template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::uint8_t>&, cudaStream_t);
template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::int16_t>&, cudaStream_t);
template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::uint16_t>&,
                                  cudaStream_t);

}  // namespace tetwarp::cuda_detail
