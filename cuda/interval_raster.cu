#include "cuda/interval_raster.h"

#include <algorithm>

#include "cuda/gather.h"
#include "cuda/voxel_sink.cuh"
#include "deform/core/row_interval.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kTileI = 32, kTileJ = 8, kTileK = 16;  ///< voxels of a tile
constexpr int kTileRows = kTileJ * kTileK;
constexpr int kTileThreads = 32 * kTileJ;  ///< a warp a column of rows
constexpr int kTileBlocks = 4;             ///< a multiprocessor
constexpr int kSlots = 256;                ///< tetrahedra whose arithmetic is prepared at a time
constexpr int kMostTetrahedra = 640;       ///< of a tile
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
  Box found{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  bool moving = false;
  if (cells_of(task.moves[0], from, to)) {
    const glm::ivec3 first = from / kBlockCells, size = to / kBlockCells - first + 1;
    for (int n = static_cast<int>(threadIdx.x & 31); n < size.x * size.y * size.z; n += 32) {
      const glm::ivec3 block = first + glm::ivec3(n % size.x, n / size.x % size.y, n / (size.x * size.y));
      const BlockMoves moves = task.moves[1 + (block.z * task.blocks.y + block.y) * task.blocks.x + block.x];
      glm::ivec3 first_cell = block * kBlockCells, last_cell = glm::min(first_cell + kBlockCells, lattice.cells) - 1;
      if (!cells_of(moves, first_cell, last_cell)) continue;
      found.grow(first_cell);
      found.grow(last_cell);
      moving |= moves.low != glm::ivec3(0) || moves.high != glm::ivec3(0);
    }
  }
  bool inside = true;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {
    found.low[axis] = warp_min(found.low[axis]);
    found.high[axis] = warp_max(found.high[axis]);
    inside &= low[axis] >= 0 && high[axis] <= lattice.cells[axis] * cell[axis];
  }
  const bool any = found.low.x <= found.high.x, rests = __all_sync(~0u, !moving) != 0 && inside && any;
  if ((threadIdx.x & 31) != 0) return;
  task.cells[number] = {any ? found.low : glm::ivec3(0), any ? found.high - found.low + 1 : glm::ivec3(0), rests, 0};
}

/// What a tetrahedron's voxels need: their weights by Cramer's rule, and how far its vertices are displaced.
struct Weighing {
  glm::vec3 from_d;  ///< from D to the first voxel of the tile, 2^-12 voxel
  float reciprocal;  ///< of the determinant; 0: not in float
  glm::vec3 bc;
  float moved_x;
  glm::vec3 ca;
  float moved_y;
  glm::vec3 ab;
  float moved_z;
  glm::vec4 moved_a, moved_b, moved_c;
};
constexpr int kQuads = sizeof(Weighing) / sizeof(float4);

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
  float4 prepared[kSlots][kQuads];  ///< faces, and then `Weighing`
  Row rows[kTileRows];
  unsigned numbers[kMostTetrahedra];      ///< in the order of their numbers: `TileWorker::number_of`
  unsigned spans[kMostTetrahedra];        ///< `Span` of each
  unsigned short items[kSlots * kTileJ];  ///< rows of one y of a tetrahedron
  unsigned unsure[kMostUnsure];
  unsigned per_warp[kTileJ];
  unsigned count, item_count, unsure_count, settled;
  bool overlaps;  ///< or too many are unsure
};

/// Cells on each axis that may reach a tile, at most; powers of two.
constexpr struct { int x, y, z; } kMostCells{1 << 10, 1 << 9, 1 << 9};

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

/// A voxel that is not well inside the source, or whose weights are not for float; likewise.
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
  __device__ LatticeTetrahedron tetrahedron(unsigned number) const {
    const glm::ivec3 cell(number >> 3 & (kMostCells.x - 1), number >> 13 & (kMostCells.y - 1), number >> 22);
    return LatticeTetrahedron::of_cell(first_cell + cell, static_cast<int>(number & 7));
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
    for (int z = 0; z < size.z; z += kAtOnce) {
      typename Sink::Copied copied[kAtOnce];
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k)
        if (z + k < size.z) copied[k] = sink.fetch(at + glm::ivec3(0, 0, z + k));
#pragma unroll
      for (int k = 0; k < kAtOnce; ++k)
        if (z + k < size.z) sink.put(sink.place(at + glm::ivec3(0, 0, z + k)), copied[k]);
    }
  }

  /// Whether a tetrahedron may own voxels of the tile.
  __device__ bool may_own(const LatticeTetrahedron& t, Span& span) const {
    const StepLattice& lattice = task.lattice;
    const glm::i32vec3 d = lattice.deformed(t.d);
    Box box{d, d};
    box.grow(lattice.deformed(t.a()));
    box.grow(lattice.deformed(t.b()));
    box.grow(lattice.deformed(t.c()));
    const IntBox own = candidates(task.turns, box.low, box.high, voxels);
    const glm::ivec3 begin = own.begin - voxels.begin, end = own.end - voxels.begin;
    span = {begin.y, end.y, begin.z, end.z, fits_int64(box)};
    return !own.is_empty();
  }

  /// Lists the tetrahedra that may own voxels of the tile, in rising order. @return whether there is room for them
  __device__ bool list() const {
    if (cells.x > kMostCells.x || cells.y > kMostCells.y || cells.z > kMostCells.z) return false;
    const int total = cells.x * cells.y * cells.z * kTetrahedraPerCell, lane = thread & 31, warp = thread / 32;
    unsigned listed = 0;
#pragma unroll 1
    for (int from = 0; from < total; from += kTileThreads) {
      const int n = from + thread, cell = n / kTetrahedraPerCell;
      const unsigned number =
          number_of({cell % cells.x, cell / cells.x % cells.y, cell / (cells.x * cells.y)}, n % kTetrahedraPerCell);
      Span span{};
      const bool reaches = n < total && may_own(tetrahedron(number), span);
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

  /// From the first voxel of the tile to a vertex, 2^-12 voxel. @param n  0 to 3: A, B, C, D
  __device__ glm::i32vec3 vertex(const LatticeTetrahedron& t, int n) const {
    glm::ivec3 at = t.d;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis)
      if (n != 3 && (axis == n) != t.centre) at[axis] += 1 - 2 * t.down[axis];
    return task.lattice.deformed(at) - voxels.begin * kStepsPerVoxel;
  }

  /// One face of a tetrahedron, of the four that as many lanes have; then its rows.
  __device__ void set_face(int slot, unsigned place, int n) const {
    constexpr float kUnsure = 1e9f;  // the error of what is not for float
    const unsigned quad = 0xFu << (thread & 28);
    Span span = Span::of(memory.spans[place]);
    RowFace crossing{0, 0, 0, kUnsure};
    bool is_lower = n < 2, has_volume = true;
    if (span.is_small) {
      const LatticeTetrahedron t = tetrahedron(memory.numbers[place]);
      Face<std::int64_t> face;
      const glm::i32vec3 mine = vertex(t, n);
      const auto other = [&](int k) {
        const int lane = (thread & 28) | ((n + k) & 3);
        return glm::i32vec3(__shfl_sync(quad, mine.x, lane), __shfl_sync(quad, mine.y, lane),
                            __shfl_sync(quad, mine.z, lane));
      };
      const glm::i32vec3 p = other(1), q = other(2), r = other(3);
      has_volume = make_face_towards(p, q, r, mine, face);
      crossing = detail::row_face(face, signs, size, is_lower);
    }
    const unsigned before = quad & ((1u << (thread & 31)) - 1), lower = __ballot_sync(quad, is_lower) & quad;
    const int at = is_lower ? __popc(lower & before) : 3 - __popc(before & ~lower);
    memory.prepared[slot][at] = make_float4(crossing.at, crossing.along_y, crossing.along_z, crossing.error);
    if (n != 0) return;
    memory.prepared[slot][4].x = __int_as_float(__popc(lower));
    if (!has_volume) {  // owns nothing
      span.y_end = span.y_begin;
      memory.spans[place] = span.word();
    }
    unsigned item = atomicAdd(&memory.item_count, static_cast<unsigned>(span.y_end - span.y_begin));
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

  /// Marks where intervals start: a thread some tetrahedron's rows of one y.
  __device__ void mark_all(unsigned batch) const {
    const unsigned items = memory.item_count;
#pragma unroll 1
    for (unsigned n = static_cast<unsigned>(thread); n < items; n += kTileThreads) {
      const int slot = memory.items[n] & 255, y = memory.items[n] >> 8;
      const unsigned place = batch + static_cast<unsigned>(slot);
      const Span span = Span::of(memory.spans[place]);
      const RowsAlongZ rows(faces_of(slot), y);
#pragma unroll 1
      for (int z = span.z_begin; z < span.z_end; ++z) {
        bool is_certain = false;
        const RowInterval in = rows.interval(z, size.x, is_certain);
        if (is_certain) {
          mark(in, memory.rows[z * kTileJ + y], place);
        } else {  // later: calls would cost this loop registers
          const unsigned at = atomicAdd(&memory.unsure_count, 1u);
          if (at < kMostUnsure) memory.unsure[at] = place << 16 | static_cast<unsigned>(z << 8 | y);
        }
      }
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
  __device__ void rasterise(bool in_order) const {
    const unsigned count = memory.count;
    for (unsigned batch = 0; batch < count; batch += kSlots) {
      const unsigned slots = min(count - batch, static_cast<unsigned>(kSlots));
      __syncthreads();
#pragma unroll 1
      for (int n = thread; n < static_cast<int>(4 * slots); n += kTileThreads)
        set_face(n / 4, batch + static_cast<unsigned>(n / 4), n & 3);
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
  __device__ void weigh() const {
    if (thread >= static_cast<int>(min(memory.count, static_cast<unsigned>(kSlots)))) return;
    const StepLattice& lattice = task.lattice;
    const LocalTetrahedron local(lattice, as_float(lattice, tetrahedron(memory.numbers[thread])),
                                 GatherPoint(lattice, voxels.begin, signs));
    const Cramer m(local.a, local.b, local.c);
    const float s = (detail::norm1(local.a) + detail::norm1(local.b)) + detail::norm1(local.c);
    const bool usable = detail::magnitude(m.det) > s * s * detail::multiply_add(detail::kThinSum, s, detail::kSlackSum);
    const auto quad = [](const glm::vec3& v, float w) { return make_float4(v.x, v.y, v.z, w); };
    const auto cross = [](const detail::Cross& v, float w) { return make_float4(v.x, v.y, v.z, w); };
    float4* to = memory.prepared[thread];
    to[0] = quad(local.r, usable ? detail::reciprocal(m.det) : 0.0f);
    to[1] = cross(m.bc, local.moved.x);
    to[2] = cross(m.ca, local.moved.y);
    to[3] = cross(m.ab, local.moved.z);
    to[4] = quad(local.moved_a, 0);
    to[5] = quad(local.moved_b, 0);
    to[6] = quad(local.moved_c, 0);
  }

  /// The voxels of one lane: a column along k. @return how many are covered
  __device__ unsigned sample() const {
    const int lane = thread & 31, y = thread / 32;
    if (lane >= size.x || y >= size.y) return 0;
    const Row* row = &memory.rows[y];
    const auto rx = static_cast<float>(lane * kStepsPerVoxel), ry = static_cast<float>(y * kStepsPerVoxel);
    glm::ivec3 at = voxels.begin + glm::ivec3(lane, y, 0);
    const int out_slice = sink.per_slice(), end = voxels.end.z;
    int out = sink.place(at) - out_slice;
    unsigned held = kNoOwner, left = 0;
    float reciprocal = 0, rz = 0, a = 0, b = 0, c = 0, az = 0, bz = 0, cz = 0, steps = 0;
    glm::vec3 moved(0), moved_a(0), moved_b(0), moved_c(0);
    typename Sink::Pending pending{};
    for (; at.z < end; ++at.z) {
      const unsigned place = row->owner_of(lane);
      row += kTileJ;
      if (place != held) {
        held = place;
        reciprocal = 0;
        if (place < kSlots) {
          const float4* from = memory.prepared[place];
          const float4 d = from[0], bc = from[1], ca = from[2], ab = from[3], ma = from[4], mb = from[5], mc = from[6];
          const float x = rx + d.x, yy = ry + d.y;
          rz = d.z;
          reciprocal = d.w;
          a = x * bc.x + yy * bc.y;
          b = x * ca.x + yy * ca.y;
          c = x * ab.x + yy * ab.y;
          az = bc.z;
          bz = ca.z;
          cz = ab.z;
          moved = {bc.w, ca.w, ab.w};
          moved_a = {ma.x, ma.y, ma.z};
          moved_b = {mb.x, mb.y, mb.z};
          moved_c = {mc.x, mc.y, mc.z};
        }
      }
      const float r = rz + steps;
      steps += float{kStepsPerVoxel};
      const Weights w{(a + r * az) * reciprocal, (b + r * bz) * reciprocal, (c + r * cz) * reciprocal};
      const glm::vec3 by = blend(w, moved, moved_a, moved_b, moved_c);
      sink.finish(out, pending);
      out += out_slice;
      sink.start(out, at, by, reciprocal != 0, pending);
      left = left << 1 | static_cast<unsigned>(!pending.any);
    }
    sink.finish(out, pending);
    unsigned covered = static_cast<unsigned>(size.z - __popc(left));
    for (; left != 0; left &= left - 1) {  // not within the loop above: calls would cost it registers
      at.z = end - __ffs(static_cast<int>(left));
      const unsigned place = memory.rows[(at.z - voxels.begin.z) * kTileJ + y].owner_of(lane);
      if (place == kNoOwner) {
        sink.nothing(sink.place(at));
      } else {
        covered += write_slowly(task, sink, tetrahedron(memory.numbers[place]), sink.place(at), at, signs);
      }
    }
    return covered;
  }
};

template <class Sink>
__global__ void __launch_bounds__(kTileThreads, kTileBlocks)
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
  if (!worker.list()) {
    if (thread == 0) {
      cells.left = 1;
      atomicAdd(&task.counters->left, 1u);
    }
    return;
  }
#pragma unroll 1
  for (int n = 0; n < 2; ++n) {
    worker.rasterise(n != 0);
    if (!memory.overlaps) break;
    __syncthreads();
    worker.clear();
  }
  worker.mark_holes();
  worker.weigh();
  __syncthreads();
  const unsigned covered = warp_sum(worker.sample());
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

/// Where tiles begin, so that none has voxels of both sides of the nudge's turn.
int tile_origin(int begin, int end, int turn, int size) {
  return turn > begin && turn < end ? turn - (turn - begin + size - 1) / size * size : begin;
}

TileTask make_task(const DeviceField& field, const SlabBox& box) {
  TileTask task{};
  task.lattice = field.steps;
  task.turns = NudgeTurns(field.frame.nudge);
  task.box = {glm::ivec3(box.begin), glm::ivec3(box.begin + box.size)};
  task.blocks = (field.steps.cells + kBlockCells - 1) / kBlockCells;
  const glm::ivec3 size(kTileI, kTileJ, kTileK);
  for (int axis = 0; axis < 3; ++axis) {
    task.origin[axis] = tile_origin(task.box.begin[axis], task.box.end[axis], task.turns.first_down[axis], size[axis]);
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
template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::uint8_t>&, cudaStream_t);
template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::int16_t>&, cudaStream_t);
template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::uint16_t>&,
                                  cudaStream_t);

}  // namespace tetwarp::cuda_detail
