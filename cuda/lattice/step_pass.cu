// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/lattice/step_pass.cuh"

#include <type_traits>

#include "cuda/lattice/cell_volumes.cuh"
#include "cuda/lattice/float_snap.cuh"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kColumns = InvertedPairs::kColumns + 2;  ///< vertices of a warp along i, two a thread; the outer ones
                                                       ///< belong to its neighbours
constexpr int kRows = 8;                               ///< of a thread block, a warp each
constexpr int kBlocks = 2;                             ///< a multiprocessor
constexpr unsigned kManyBlocks = 512;                  ///< fill a device
constexpr int kPlanes = 40;                            ///< along k that a thread goes at most; whole MovingBlocks

/// Two columns of vertices side by side: the part of a thread. Beyond the lattice its border vertices are repeated.
///
/// All that is asked of the columns is held in one register, two bits a question, one for each column:
///
///     bit  7 6      5 4    3 2     1 0
///          Packed | Cell | Inner | Owned
struct Pair {
  int y, z;  ///< row, and the plane at hand
  unsigned flags;

  using Owned = BitField<0, 2>;            ///< in the lattice and not left to a neighbouring warp
  using Inner = BitField<Owned::kEnd, 2>;  ///< with neighbours along i and j
  using Cell = BitField<Inner::kEnd, 2>;   ///< with cells from them on, for this warp
  using Packed = BitField<Cell::kEnd, 2>;  ///< owned, and to be packed
  static_assert(Packed::kEnd == 8);

  __device__ static int first_column(int y) {
    return InvertedPairs::column(y, static_cast<int>(blockIdx.x), static_cast<int>(threadIdx.x));
  }
  __device__ Pair(const StepPass& pass, int row, int plane) : y(row), z(plane), flags(0) {
    const glm::ivec3& cells = pass.lattice.cells;
    const int lane = static_cast<int>(threadIdx.x);
    for (int n = 0; n < 2; ++n) {
      const int x = first_column(y) + n;
      const bool owned = x >= 0 && x <= cells.x && lane + n > 0 && lane + n < kColumns / 2;
      const bool inner = x > 0 && x < cells.x && y > 0 && y < cells.y;
      const bool cell = owned && x < cells.x && y < cells.y;
      flags |= (Owned::put(owned) | Inner::put(inner) | Cell::put(cell) | Packed::put(owned && pass.packed)) << n;
    }
    asm volatile("" : "+r"(flags));  // not to be computed again at every use
  }
  /// @tparam Flag  a question  @param column  0 or 1
  template <class Flag>
  __device__ bool is(int column) const {
    return (flags & Flag::put(1) << column) != 0;
  }
};

/// How far the pair's vertices moved on one plane, in its row and the next; raised.
struct Plane {
  glm::vec3 row[2], next_row[2];
};

__device__ glm::vec3 from_left(const glm::vec3& v) {
  return {__shfl_up_sync(kAllLanes, v.x, 1), __shfl_up_sync(kAllLanes, v.y, 1), __shfl_up_sync(kAllLanes, v.z, 1)};
}
__device__ glm::vec3 from_right(const glm::vec3& v) {
  return {__shfl_down_sync(kAllLanes, v.x, 1), __shfl_down_sync(kAllLanes, v.y, 1),
          __shfl_down_sync(kAllLanes, v.z, 1)};
}

/// Corner tetrahedra around the pair's even vertex, at place kEven of the pair, and the centres of its two cells.
/// Called by whole warps. What lies beyond the lattice is taken for a rest of the border, and where that is upright it
/// does not matter that there is nothing.
/// @param below, before  the neighbours of the even vertex in the row before and on the plane before
/// @return whether something of this lane is inverted
template <bool kRange, int kEven>
__device__ bool describe_pair(const StepPass& pass, const Pair& pair, const glm::vec3& before, const glm::vec3& below,
                              const Plane& here, const Plane& above, Seen& corners, Seen& centres) {
  const glm::vec3& cell = pass.lattice.cell;
  const glm::vec3 beside = kEven == 0 ? from_left(here.row[1]) : from_right(here.row[0]);
  const glm::vec3& d = here.row[kEven];
  Edges edges{{(kEven == 0 ? here.row[1] : beside) - d, (kEven == 0 ? beside : here.row[0]) - d},
              {here.next_row[kEven] - d, below - d},
              {above.row[kEven] - d, before - d}};
  edges.x[0].x += cell.x;
  edges.x[1].x -= cell.x;
  edges.y[0].y += cell.y;
  edges.y[1].y -= cell.y;
  edges.z[0].z += cell.z;
  edges.z[1].z -= cell.z;
  const Around<kRange> around(edges);
  const auto first = [&] {
    if constexpr (kEven == 0) {
      return Centre<kRange, true>(pass, here.row[1], here.next_row[0], above.row[0], above.next_row[1]);
    } else {
      return Centre<kRange, false>(pass, above.next_row[0], above.row[1], here.next_row[1], here.row[0]);
    }
  }();
  const auto second = [&] {
    if constexpr (kEven == 0) {
      return Centre<kRange, false>(pass, above.next_row[1], from_right(above.row[0]), from_right(here.next_row[0]),
                                   here.row[1]);
    } else {
      return Centre<kRange, true>(pass, beside, here.next_row[1], above.row[1], from_right(above.next_row[0]));
    }
  }();
  const bool sure = (around.is_upright() | !pair.is<Pair::Owned>(kEven)) &
                    (first.is_upright() | !pair.is<Pair::Cell>(0)) & (second.is_upright() | !pair.is<Pair::Cell>(1));
  if (!kRange && __all_sync(kAllLanes, sure)) return false;
  const unsigned inverted = corners.inverted + centres.inverted;
  const bool has_above = pair.z < pass.lattice.cells.z,
             has_all = pair.is<Pair::Inner>(kEven) && pair.z > 0 && has_above;
  if (pair.is<Pair::Owned>(kEven))
    around.add(pass, {Pair::first_column(pair.y) + kEven, pair.y, pair.z}, has_all, edges, corners);
  if (has_above && pair.is<Pair::Cell>(0)) first.add(centres);
  if (has_above && pair.is<Pair::Cell>(1)) second.add(centres);
  return corners.inverted + centres.inverted != inverted;
}

/// Reads displacements, a plane ahead of their use, and snaps them.
template <bool kExact>
struct PlaneReader {
  const StepPass& pass;
  const FloatSnap& fast;
  int z;              ///< the plane that was read
  int row, next_row;  ///< number of the first column's vertex on the first plane, in its row and the next
  int beside;         ///< how much larger the second column's is
  Plane given;

  __device__ void read_next() {
    ++z;
    const int plane = detail::clamp_to(z, pass.lattice.cells.z) * pass.lattice.slice;
    const glm::vec3 *here = pass.displacement + (plane + row), *there = pass.displacement + (plane + next_row);
    given.row[0] = here[0];
    given.row[1] = here[beside];
    given.next_row[0] = there[0];
    given.next_row[1] = there[beside];
  }
  __device__ Plane raised() const {
    Plane moved{{fast.raised(given.row[0]), fast.raised(given.row[1])},
                {fast.raised(given.next_row[0]), fast.raised(given.next_row[1])}};
    if (kExact) return moved;  // each is checked by the thread that packs it
    const StepPacking& packing = pass.lattice.packing;
    const std::uint32_t excess = packing.excess(moved.row[0]) | packing.excess(moved.row[1]) |
                                 packing.excess(moved.next_row[0]) | packing.excess(moved.next_row[1]);
    const bool certain = fast.is_certain(given.row[0], moved.row[0]) & fast.is_certain(given.row[1], moved.row[1]) &
                         fast.is_certain(given.next_row[0], moved.next_row[0]) &
                         fast.is_certain(given.next_row[1], moved.next_row[1]);
    if (certain && excess == 0) return moved;
    const int plane = detail::clamp_to(z, pass.lattice.cells.z) * pass.lattice.slice;
    moved.row[0] = raised_slowly(pass, given.row[0], plane + row);
    moved.row[1] = raised_slowly(pass, given.row[1], plane + row + beside);
    moved.next_row[0] = raised_slowly(pass, given.next_row[0], plane + next_row);
    moved.next_row[1] = raised_slowly(pass, given.next_row[1], plane + next_row + beside);
    return moved;
  }
};

/// Packs the pair's vertices on the plane at hand.
/// @param packed  where the first column's vertex goes
/// @param moves   gets the bits that differ from those of no displacement
template <bool kExact>
__device__ void pack_pair(const StepPass& pass, const Pair& pair, const PlaneReader<kExact>& reader, const Plane& here,
                          std::uint64_t* packed, std::uint32_t& moves) {
  const StepPacking& packing = pass.lattice.packing;
  const glm::vec3& lift = packing.lift();
  std::uint32_t excess = 0;
#pragma unroll
  for (int n = 0; n < 2; ++n) {
    const glm::vec3& v = here.row[n];
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) moves |= __float_as_uint(v[axis]) ^ __float_as_uint(lift[axis]);
    if (kExact) excess |= packing.excess(v);
    if (pair.is<Pair::Packed>(n)) packed[n != 0 ? reader.beside : 0] = packing.pack(v);
  }
  if (kExact && excess != 0) {  // beyond the packing, or at its very end: others saw it rounded to a half
    pass.found->wide = 1;
    const int number = pair.z * pass.lattice.slice + reader.row;
    raised_slowly(pass, pass.displacement[number], number);
    raised_slowly(pass, pass.displacement[number + reader.beside], number + reader.beside);
  }
}

/// Snaps, packs and describes the vertices of a lattice. A warp has 64 columns of a row, two a thread, and goes
/// `planes` along k; the outer columns are its neighbours' too. Columns begin where the first of a pair is even on
/// planes of even k. It goes two planes at a time, so that neither registers nor the parity of vertices change places:
///
///     plane z - 1     before      the even vertex's neighbour below along k: kept
///     plane z         here        the pair, and the pair one row on: kept; one row back: `given_below`, a plane ahead
///     plane z + 1     above       snapped in this step
///     plane z + 2                 read in this step, snapped in the next
///
///     grid (words of a row, rows / kRows, all planes / planes), block (32 lanes, kRows rows)
///
/// @tparam kExact  whether `fast` is exact wherever the packing holds a vertex  @tparam kRange  `StepPass::wants_range`
/// @param pass         what is read and written
/// @param corner_rest  six times the volume of an undeformed corner tetrahedron, steps of 2^-12 voxel
/// @param centre_rest  of an undeformed centre
/// @param planes       whole MovingBlocks
template <bool kExact, bool kRange>
__global__ void __launch_bounds__(32 * kRows, kBlocks)
    step_pass_kernel(const __grid_constant__ StepPass pass, const __grid_constant__ FloatSnap fast, float corner_rest,
                     float centre_rest, int planes) {
  const StepLattice& lattice = pass.lattice;
  const glm::ivec3& cells = lattice.cells;
  Pair pair(pass, static_cast<int>(blockIdx.y * kRows + threadIdx.y), static_cast<int>(blockIdx.z) * planes);
  if (pair.y > cells.y) return;  // the whole warp
  const int end = min(pair.z + planes, cells.z + 1);
  const int left = detail::clamp_to(Pair::first_column(pair.y), cells.x),
            beside = detail::clamp_to(Pair::first_column(pair.y) + 1, cells.x) - left;
  PlaneReader<kExact> reader{
      pass, fast, pair.z - 2, pair.y * lattice.row + left, min(pair.y + 1, cells.y) * lattice.row + left, beside};
  reader.read_next();
  Plane here = reader.raised();
  glm::vec3 before = here.row[0];
  reader.read_next();
  here = reader.raised();
  reader.read_next();
  const int row_below = max(pair.y - 1, 0) * lattice.row + left;
  const auto below_at = [&](int even, int z) {
    return min(z, cells.z) * lattice.slice + row_below + (even != 0 ? beside : 0);
  };
  glm::vec3 given_below = pass.displacement[below_at(0, pair.z)];
  std::uint64_t* packed = pass.packed + (pair.z * lattice.slice + reader.row);
  Seen corners, centres;
  std::uint32_t moves = 0;
  // One plane. Not a function of its own: as a member of a struct with this state it spilled 16 to 24 bytes more.
  const auto step = [&](auto even, const glm::vec3& before, const Plane& here, Plane& above) {
    constexpr int kEven = decltype(even)::value;
    glm::vec3 below = fast.raised(given_below);
    if (!kExact && (lattice.packing.excess(below) != 0 || !fast.is_certain(given_below, below)))
      below = raised_slowly(pass, given_below, below_at(kEven, pair.z));
    given_below = pass.displacement[below_at(1 - kEven, pair.z + 1)];
    above = reader.raised();
    reader.read_next();
    pack_pair(pass, pair, reader, here, packed, moves);
    const unsigned pairs = __ballot_sync(
        kAllLanes, describe_pair<kRange, kEven>(pass, pair, before, below, here, above, corners, centres));
    if (pairs != 0 && threadIdx.x == 0) pass.inverted.words[pass.inverted.word(pair.y, pair.z, blockIdx.x)] = pairs;
    ++pair.z;
    packed += lattice.slice;
  };
  while (pair.z < end) {
    Plane above, next;
    step(std::integral_constant<int, 0>(), before, here, above);
    if (pair.z < end) {
      before = here.row[1];
      step(std::integral_constant<int, 1>(), before, above, next);
    }
    before = above.row[0];
    here = next;
    if (pair.z % MovingBlocks::kSide != 0 && pair.z < end) continue;
    if (moves != 0) {
      pass.moving.at({left, pair.y, pair.z - 1}) = 1;
      pass.moving.at({left + beside, pair.y, pair.z - 1}) = 1;
    }
    moves = 0;
  }
  if (kRange) {
    note_range(corners.least / corner_rest, corners.most / corner_rest, pass.found);
    note_range(centres.least / centre_rest, centres.most / centre_rest, pass.found);
  }
  note_counts(corners.inverted + centres.inverted, corners.degenerate + centres.degenerate, pass.found);
}

}  // namespace

void run_step_pass(const StepPass& pass, cudaStream_t stream) {
  const glm::ivec3 vertices = pass.lattice.cells + 1;
  const glm::vec3 &cell = pass.lattice.cell, x(cell.x, 0, 0), y(0, cell.y, 0), z(0, 0, cell.z);
  const float corner_rest = detail::edge_determinant(x, y, z),
              centre_rest = detail::edge_determinant(y + z, x + z, x + y);
  dim3 blocks(static_cast<unsigned>(pass.inverted.words_per_row),
              static_cast<unsigned>((vertices.y + kRows - 1) / kRows));
  // Blocks read two planes beyond their own. Where they are few that costs less than to go far.
  const auto parts = [&](int planes) { return static_cast<unsigned>((vertices.z + planes - 1) / planes); };
  const int planes = blocks.x * blocks.y * parts(kPlanes) < kManyBlocks ? MovingBlocks::kSide : kPlanes;
  blocks.z = parts(planes);
  const FloatSnap fast(pass.frame, pass.lattice, pass.lattice.packing.lift());
  const auto kernel = pass.wants_range
                          ? (fast.is_exact() ? step_pass_kernel<true, true> : step_pass_kernel<false, true>)
                          : (fast.is_exact() ? step_pass_kernel<true, false> : step_pass_kernel<false, false>);
  kernel<<<blocks, dim3(32, kRows), 0, stream>>>(pass, fast, corner_rest, centre_rest, planes);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
