// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/lattice/step_pass.cuh"

#include <type_traits>

#include "cuda/lattice/float_snap.cuh"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kColumns = InvertedPairs::kColumns + 2;  ///< vertices of a warp along i, two a thread; the outer ones
                                                       ///< belong to its neighbours
constexpr int kRows = 8;                               ///< of a thread block, a warp each
constexpr int kBlocks = 2;                             ///< a multiprocessor
constexpr int kPlanes = 40;                            ///< along k that a thread goes; whole MovingBlocks

/// What is seen of tetrahedra of one kind: their volumes, the sign of the undeformed ones taken out. They share their
/// rest volume, so the division waits.
struct Seen {
  float least = INFINITY, most = -INFINITY;
  unsigned inverted = 0, degenerate = 0;

  __device__ void add(float volume) {
    least = fminf(least, volume);
    most = fmaxf(most, volume);
  }
  __device__ void add(const Seen& other) {
    least = fminf(least, other.least);
    most = fmaxf(most, other.most);
    inverted += other.inverted;
    degenerate += other.degenerate;
  }
};

/// The volume with the sign that it certainly has.
__device__ void add_exactly(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, float turn, Seen& seen) {
  const float volume = detail::edge_determinant(a, b, c) * turn + 0.0f;  // never -0
  seen.add(volume);
  seen.degenerate += volume == 0;
  seen.inverted += volume < 0;
}

/// Three pairs of edges from a vertex, up and down.
struct Edges {
  glm::vec3 x[2], y[2], z[2];
};

/// The corner tetrahedra around an even vertex one by one; those that the lattice has. Out of line, with everything by
/// value, so that nothing of it weighs on the common case.
__device__ __noinline__ Seen around_exactly(const StepPass& pass, glm::ivec3 at, Edges edges) {
  Seen seen;
  const glm::ivec3& cells = pass.lattice.cells;
#pragma unroll 1
  for (int n = 0; n < 8; ++n) {
    const glm::ivec3 down(n & 1, n >> 1 & 1, n >> 2), cell = at - down;
    if (cell.x < 0 || cell.y < 0 || cell.z < 0 || cell.x >= cells.x || cell.y >= cells.y || cell.z >= cells.z) continue;
    const float turn = ((down.x ^ down.y ^ down.z) & 1) != 0 ? -1.0f : 1.0f;
    add_exactly(edges.x[down.x], edges.y[down.y], edges.z[down.z], turn, seen);
  }
  return seen;
}

/// Likewise the centre of a cell.
__device__ __noinline__ Seen centre_exactly(glm::vec3 a, glm::vec3 b, glm::vec3 c, float turn) {
  Seen seen;
  add_exactly(a, b, c, turn, seen);
  return seen;
}

constexpr float kError = 8.0f / (1 << 24);  ///< that of `detail::edge_determinant`

/// Six times a signed volume, in two ways: as the Jacobian determinant is defined, and fused, where only its sign
/// counts.
template <bool kRange>
struct Volume;
template <>
struct Volume<true> {
  __device__ static detail::Cross cross(const glm::vec3& a, const glm::vec3& b) { return detail::cross(a, b); }
  __device__ static float dot(const glm::vec3& a, const detail::Cross& n) { return detail::dot(a, n); }
};
template <>
struct Volume<false> {
  __device__ static detail::Cross cross(const glm::vec3& a, const glm::vec3& b) {
    return {fmaf(a.y, b.z, -(a.z * b.y)), fmaf(a.z, b.x, -(a.x * b.z)), fmaf(a.x, b.y, -(a.y * b.x))};
  }
  __device__ static float dot(const glm::vec3& a, const detail::Cross& n) {
    return fmaf(a.z, n.z, fmaf(a.y, n.y, a.x * n.x));
  }
};

/// The eight corner tetrahedra around an even vertex.
template <bool kRange>
struct Around {
  float volumes[8], least = INFINITY, bound;

  __device__ explicit Around(const Edges& edges) {
    const auto both = [](const glm::vec3(&e)[2]) { return detail::norm1(e[0]) + detail::norm1(e[1]); };
    bound = kError * ((both(edges.x) * both(edges.y)) * both(edges.z));
#pragma unroll
    for (int n = 0; n < 4; ++n) {
      const detail::Cross normal = Volume<kRange>::cross(edges.y[n & 1], edges.z[n >> 1]);
      const float sign = (n & 1) != n >> 1 ? -1.0f : 1.0f;
      volumes[2 * n] = sign * Volume<kRange>::dot(edges.x[0], normal);
      volumes[2 * n + 1] = -sign * Volume<kRange>::dot(edges.x[1], normal);
      least = fminf(least, fminf(volumes[2 * n], volumes[2 * n + 1]));
    }
  }
  __device__ bool is_upright() const { return least > bound; }
  __device__ void add_range(Seen& seen) const {
    seen.least = fminf(seen.least, least);
#pragma unroll
    for (const float volume : volumes) seen.most = fmaxf(seen.most, volume);
  }
  /// @param has_all  whether the lattice has all of them
  __device__ void add(const StepPass& pass, const glm::ivec3& at, bool has_all, const Edges& edges, Seen& seen) const {
    float nearest = INFINITY;
    unsigned inverted = 0;
#pragma unroll
    for (const float volume : volumes) {
      nearest = fminf(nearest, fabsf(volume));
      inverted += volume < 0;
    }
    if (!(has_all && nearest > bound)) return seen.add(around_exactly(pass, at, edges));
    seen.inverted += inverted;
    if (kRange) add_range(seen);
  }
};

/// The centre of a cell: D is an even cell's last corner, and A, B, C are beside its first; in an odd one it is the
/// other way round.
template <bool kRange, bool kEvenCell>
struct Centre {
  glm::vec3 a, b, c;  ///< from D
  float volume, bound;

  /// @param a, b, c, d  how far the corners moved
  __device__ Centre(const StepPass& pass, const glm::vec3& to_a, const glm::vec3& to_b, const glm::vec3& to_c,
                    const glm::vec3& d)
      : a(to_a - d), b(to_b - d), c(to_c - d) {
    using detail::norm1;
    const glm::vec3 to = kEvenCell ? -pass.lattice.cell : pass.lattice.cell;
    a.y += to.y;
    a.z += to.z;
    b.x += to.x;
    b.z += to.z;
    c.x += to.x;
    c.y += to.y;
    const float determinant = Volume<kRange>::dot(a, Volume<kRange>::cross(b, c));
    volume = kEvenCell ? -determinant : determinant;
    bound = kError * ((norm1(a) * norm1(b)) * norm1(c));
  }
  __device__ bool is_upright() const { return volume > bound; }
  __device__ void add(Seen& seen) const {
    if (fabsf(volume) > bound) {
      if (kRange) seen.add(volume);
      seen.inverted += volume < 0;
    } else {
      seen.add(centre_exactly(a, b, c, kEvenCell ? -1.0f : 1.0f));
    }
  }
};

/// Two columns of vertices side by side: the part of a thread. Beyond the lattice its border vertices are repeated.
struct Pair {
  int y, z;        ///< row, and the plane at hand
  unsigned flags;  ///< one register for all that is asked of the columns

  static constexpr unsigned kOwned = 1;    ///< in the lattice and not left to a neighbouring warp
  static constexpr unsigned kInner = 4;    ///< with neighbours along i and j
  static constexpr unsigned kCell = 16;    ///< with cells from them on, for this warp
  static constexpr unsigned kPacked = 64;  ///< owned, and to be packed

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
      flags |= ((owned ? kOwned : 0) | (inner ? kInner : 0) | (cell ? kCell : 0) | (owned && pass.packed ? kPacked : 0))
               << n;
    }
    asm volatile("" : "+r"(flags));  // not to be computed again at every use
  }
  /// @param column  0 or 1
  __device__ bool is(unsigned flag, int column) const { return (flags & flag << column) != 0; }
};

/// How far the pair's vertices moved on one plane, in its row and the next; raised.
struct Plane {
  glm::vec3 row[2], next_row[2];
};

__device__ glm::vec3 from_left(const glm::vec3& v) {
  return {__shfl_up_sync(~0u, v.x, 1), __shfl_up_sync(~0u, v.y, 1), __shfl_up_sync(~0u, v.z, 1)};
}
__device__ glm::vec3 from_right(const glm::vec3& v) {
  return {__shfl_down_sync(~0u, v.x, 1), __shfl_down_sync(~0u, v.y, 1), __shfl_down_sync(~0u, v.z, 1)};
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
  const bool sure = (around.is_upright() | !pair.is(Pair::kOwned, kEven)) &
                    (first.is_upright() | !pair.is(Pair::kCell, 0)) & (second.is_upright() | !pair.is(Pair::kCell, 1));
  if (!kRange && __all_sync(~0u, sure)) return false;
  const unsigned inverted = corners.inverted + centres.inverted;
  const bool has_above = pair.z < pass.lattice.cells.z,
             has_all = pair.is(Pair::kInner, kEven) && pair.z > 0 && has_above;
  if (pair.is(Pair::kOwned, kEven))
    around.add(pass, {Pair::first_column(pair.y) + kEven, pair.y, pair.z}, has_all, edges, corners);
  if (has_above && pair.is(Pair::kCell, 0)) first.add(centres);
  if (has_above && pair.is(Pair::kCell, 1)) second.add(centres);
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

/// A warp has 64 columns of a row and goes along k, two planes at a time. Neighbours along i are other lanes', those
/// along j and k are read or kept. Columns begin where the first of a pair is even on planes of even k.
template <bool kExact, bool kRange>
__global__ void __launch_bounds__(32 * kRows, kBlocks)
    step_pass_kernel(const __grid_constant__ StepPass pass, const __grid_constant__ FloatSnap fast, float corner_rest,
                     float centre_rest) {
  const StepLattice& lattice = pass.lattice;
  const glm::ivec3& cells = lattice.cells;
  Pair pair(pass, static_cast<int>(blockIdx.y * kRows + threadIdx.y), static_cast<int>(blockIdx.z) * kPlanes);
  if (pair.y > cells.y) return;  // the whole warp
  const int end = min(pair.z + kPlanes, cells.z + 1);
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
  const auto step = [&](auto even, const glm::vec3& before, const Plane& here, Plane& above) {
    constexpr int kEven = decltype(even)::value;
    glm::vec3 below = fast.raised(given_below);
    if (!kExact && (lattice.packing.excess(below) != 0 || !fast.is_certain(given_below, below)))
      below = raised_slowly(pass, given_below, below_at(kEven, pair.z));
    given_below = pass.displacement[below_at(1 - kEven, pair.z + 1)];
    above = reader.raised();
    reader.read_next();
    const glm::vec3& lift = lattice.packing.lift();
    std::uint32_t excess = 0;
#pragma unroll
    for (int n = 0; n < 2; ++n) {
      const glm::vec3& v = here.row[n];
#pragma unroll
      for (int axis = 0; axis < 3; ++axis) moves |= __float_as_uint(v[axis]) ^ __float_as_uint(lift[axis]);
      if (kExact) excess |= lattice.packing.excess(v);
      if (pair.is(Pair::kPacked, n)) packed[n != 0 ? beside : 0] = lattice.packing.pack(v);
    }
    if (kExact && excess != 0) {  // beyond the packing, or at its very end: others saw it rounded to a half
      pass.found->wide = 1;
      const int number = pair.z * lattice.slice + reader.row;
      raised_slowly(pass, pass.displacement[number], number);
      raised_slowly(pass, pass.displacement[number + beside], number + beside);
    }
    const unsigned pairs =
        __ballot_sync(~0u, describe_pair<kRange, kEven>(pass, pair, before, below, here, above, corners, centres));
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
  const dim3 blocks(static_cast<unsigned>(pass.inverted.words_per_row),
                    static_cast<unsigned>((vertices.y + kRows - 1) / kRows),
                    static_cast<unsigned>((vertices.z + kPlanes - 1) / kPlanes));
  const FloatSnap fast(pass.frame, pass.lattice, pass.lattice.packing.lift());
  const auto kernel = pass.wants_range
                          ? (fast.is_exact() ? step_pass_kernel<true, true> : step_pass_kernel<false, true>)
                          : (fast.is_exact() ? step_pass_kernel<true, false> : step_pass_kernel<false, false>);
  kernel<<<blocks, dim3(32, kRows), 0, stream>>>(pass, fast, corner_rest, centre_rest);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
