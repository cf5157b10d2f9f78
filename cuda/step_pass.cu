#include "cuda/step_pass.h"

#include <type_traits>

#include "cuda/findings.cuh"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kColumns = InvertedPairs::kColumns + 2;  ///< vertices of a warp along i, two a thread; the outer ones
                                                       ///< belong to its neighbours
constexpr int kRows = 8;                               ///< of a thread block, a warp each
constexpr int kBlocks = 2;                             ///< a multiprocessor
constexpr int kPlanes = 40;                            ///< along k that a thread goes; whole MovingBlocks
constexpr float kMost = 1 << 22;  ///< steps that a vertex may move: a difference of two, and a cell, is exact in float

/// Snaps displacements in float where that certainly gives what `LatticeFrame::snap_vertex` gives.
///
/// With an axis of the lattice along each axis of the grid, a displacement in steps is d m, m = high + low to 48 bits.
/// Fused multiplications round d high to whole steps and leave the rest, known to 2^-20 step; it decides wherever it is
/// not that close to a half. Where m is a power of two and vertices rest at even steps, all of that is exact, and ties
/// go to even here as there. Other ties, and far and unusable vertices, need double arithmetic.
class FloatSnap {
 public:
  explicit FloatSnap(const LatticeFrame& frame, const StepLattice& lattice) {
    const glm::dvec3 first = frame.output_from_lattice(glm::dvec3(0, 0, static_cast<double>(frame.first_slice)));
    double beside = 0;  // how far a vertex may rest from its whole step
    exact_ = true;
    for (int axis = 0; axis < 3; ++axis) {
      for (int other = 0; other < 3; ++other) {
        if (other != axis && frame.output_from_mm[axis][other] != 0) beside = 1;
        const double meant = axis == other ? double{lattice.cell[axis]} : 0.0;
        beside += std::fabs(frame.output_from_lattice.linear[axis][other] * kStepsPerVoxel - meant) *
                  static_cast<double>(frame.cells[axis]);
      }
      beside += std::fabs(first[axis] * kStepsPerVoxel - double{lattice.first[axis]});
      const double scale = frame.output_from_mm[axis][axis] * kStepsPerVoxel;
      high_[axis] = static_cast<float>(scale);
      low_[axis] = static_cast<float>(scale - double{high_[axis]});
      int exponent = 0;
      exact_ = exact_ && std::fabs(std::frexp(scale, &exponent)) == 0.5 && std::fmod(lattice.first[axis], 2.0f) == 0 &&
               std::fmod(lattice.cell[axis], 2.0f) == 0;
    }
    exact_ = exact_ && beside == 0;
    clear_ = static_cast<float>(0.5 - 1.0 / (1 << 16) - beside);
  }

  /// Whether ties go to even steps here as there.
  bool is_exact() const { return exact_; }

  /// @return whether it is certain. No `&&`: branches would cost more than they save.
  template <bool kExact>
  __device__ bool snap(const glm::vec3& displacement, glm::vec3& steps) const {
    constexpr float kToWhole = 3.0f * (1 << 22);  // adding it rounds to a whole number, ties to even
    bool certain = true;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      steps[axis] = fmaf(displacement[axis], high_[axis], kToWhole) - kToWhole;
      certain &= fabsf(steps[axis]) < kMost;  // false for NaN
      if (kExact) continue;
      const float left = fmaf(displacement[axis], high_[axis], -steps[axis]);
      certain &= fabsf(fmaf(displacement[axis], low_[axis], left)) < clear_;
    }
    return certain;
  }

 private:
  glm::vec3 high_{0}, low_{0};
  float clear_ = -1;  ///< what is left decides where it is smaller; negative: never
  bool exact_ = false;
};

/// How far a vertex moves, in steps, where float does not say. Rarely called, so kept out of loops.
/// Zero outside the lattice.
__device__ __noinline__ glm::vec3 snapped_slowly(const StepPass& pass, glm::vec3 displacement, glm::ivec3 at) {
  const glm::ivec3& cells = pass.lattice.cells;
  if (at.x < 0 || at.y < 0 || at.z < 0 || at.x > cells.x || at.y > cells.y || at.z > cells.z) return glm::vec3(0);
  const Vertex vertex = snapped(pass.frame, displacement, glm::i64vec3(at), pass.lattice.offset(at), pass.found);
  const glm::i32vec3 rest(pass.lattice.first + glm::vec3(at) * pass.lattice.cell), u = vertex.u;
  const glm::vec3 moved(-u);
  const bool near = fabsf(moved.x) < kMost && fabsf(moved.y) < kMost && fabsf(moved.z) < kMost;
  if (!near || vertex.deformed + u != rest) pass.found->beside = 1;
  return moved;
}

/// How far a vertex moves, in steps.
template <bool kExact>
__device__ glm::vec3 snapped_steps(const StepPass& pass, const FloatSnap& fast, const glm::vec3& displacement,
                                   const glm::ivec3& at) {
  glm::vec3 moved;
  return fast.snap<kExact>(displacement, moved) ? moved : snapped_slowly(pass, displacement, at);
}

template <bool kExact>
__global__ void snap_steps_kernel(const __grid_constant__ StepPass pass, FloatSnap fast) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  const glm::i64vec3 size = glm::i64vec3(pass.lattice.cells) + std::int64_t{1};
  if (n >= size.x * size.y * size.z) return;
  pass.moved[n] = snapped_steps<kExact>(pass, fast, pass.displacement[n], glm::ivec3(unravel(n, size)));
}

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

/// The eight corner tetrahedra around an even vertex. @param inner  whether it has neighbours along i and j
/// @param edges  where there is no neighbour, anything
template <bool kRange>
__device__ void add_around(const StepPass& pass, const glm::ivec3& at, bool inner, const Edges& edges, Seen& corners) {
  const auto longest = [](const glm::vec3(&e)[2]) { return fmaxf(detail::norm1(e[0]), detail::norm1(e[1])); };
  const float bound = kError * ((longest(edges.x) * longest(edges.y)) * longest(edges.z));
  float least = INFINITY, most = -INFINITY, volumes[8];
#pragma unroll
  for (int n = 0; n < 4; ++n) {
    const detail::Cross normal = Volume<kRange>::cross(edges.y[n & 1], edges.z[n >> 1]);
    const float sign = (n & 1) != n >> 1 ? -1.0f : 1.0f;
    const float up = sign * Volume<kRange>::dot(edges.x[0], normal),
                down = -sign * Volume<kRange>::dot(edges.x[1], normal);
    volumes[2 * n] = up;
    volumes[2 * n + 1] = down;
    least = fminf(least, fminf(up, down));
    if (kRange) most = fmaxf(most, fmaxf(up, down));
  }
  const bool has_all = inner && at.z > 0 && at.z < pass.lattice.cells.z;
  if (!(has_all && least > bound)) {
    float nearest = INFINITY;
    unsigned inverted = 0;
#pragma unroll
    for (const float volume : volumes) {
      nearest = fminf(nearest, fabsf(volume));
      inverted += volume < 0;
    }
    if (!(has_all && nearest > bound)) return corners.add(around_exactly(pass, at, edges));
    corners.inverted += inverted;
  }
  if (!kRange) return;
  corners.least = fminf(corners.least, least);
  corners.most = fmaxf(corners.most, most);
}

/// The centre of a cell: D is an even cell's last corner, and A, B, C are beside its first; in an odd one it is the
/// other way round. @param a, b, c, d  how far the corners moved
template <bool kRange, bool kEvenCell>
__device__ void add_centre(const StepPass& pass, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c,
                           const glm::vec3& d, Seen& centres) {
  using detail::norm1;
  const glm::vec3 to = kEvenCell ? -pass.lattice.cell : pass.lattice.cell;
  glm::vec3 da = a - d, db = b - d, dc = c - d;
  da.y += to.y;
  da.z += to.z;
  db.x += to.x;
  db.z += to.z;
  dc.x += to.x;
  dc.y += to.y;
  const float determinant = Volume<kRange>::dot(da, Volume<kRange>::cross(db, dc));
  const float volume = kEvenCell ? -determinant : determinant;
  if (detail::magnitude(volume) > kError * ((norm1(da) * norm1(db)) * norm1(dc))) {
    if (kRange) centres.add(volume);
    centres.inverted += volume < 0;
  } else {
    centres.add(centre_exactly(da, db, dc, kEvenCell ? -1.0f : 1.0f));
  }
}

/// Two columns of vertices side by side: the part of a thread.
struct Pair {
  glm::ivec3 at;  ///< vertex of the first, on the plane at hand
  bool owned[2];  ///< whether the columns are in the lattice and not left to a neighbouring warp
  bool inner[2];  ///< whether they have neighbours along i and j
  bool cell[2];   ///< whether there are cells from them on, for this warp
};

/// How far the pair's vertices moved on one plane, in its row and the next.
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
/// Called by whole warps. @param below, before  the neighbours of the even vertex in the row before and on the plane
/// before
template <bool kRange, int kEven>
__device__ void describe_pair(const StepPass& pass, const Pair& pair, const glm::vec3& before, const glm::vec3& below,
                              const Plane& here, const Plane& above, Seen& corners, Seen& centres) {
  const glm::ivec3& at = pair.at;
  const glm::vec3& cell = pass.lattice.cell;
  const glm::vec3 beside = kEven == 0 ? from_left(here.row[1]) : from_right(here.row[0]);
  if (pair.owned[kEven]) {
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
    add_around<kRange>(pass, {at.x + kEven, at.y, at.z}, pair.inner[kEven], edges, corners);
  }
  if (at.z >= pass.lattice.cells.z) return;
  if (pair.cell[0]) {
    if (kEven == 0) {
      add_centre<kRange, true>(pass, here.row[1], here.next_row[0], above.row[0], above.next_row[1], centres);
    } else {
      add_centre<kRange, false>(pass, above.next_row[0], above.row[1], here.next_row[1], here.row[0], centres);
    }
  }
  if (kEven == 0) {
    const glm::vec3 b = from_right(above.row[0]), c = from_right(here.next_row[0]);
    if (pair.cell[1]) add_centre<kRange, false>(pass, above.next_row[1], b, c, here.row[1], centres);
  } else {
    const glm::vec3 d = from_right(above.next_row[0]);
    if (pair.cell[1]) add_centre<kRange, true>(pass, beside, here.next_row[1], above.row[1], d, centres);
  }
}

/// Reads displacements, a plane ahead of their use, and snaps them.
template <bool kExact>
struct PlaneReader {
  const StepPass& pass;
  const FloatSnap& fast;
  glm::ivec3 at;             ///< vertex of the pair's first column on the plane that was read
  bool row[2], next_row[2];  ///< whether the lattice has them
  int vertex;                ///< number of `at`
  Plane given;

  __device__ void read_next() {
    ++at.z;
    vertex += pass.lattice.slice;
    const bool has = at.z >= 0 && at.z <= pass.lattice.cells.z;
#pragma unroll
    for (int n = 0; n < 2; ++n) {
      given.row[n] = has && row[n] ? pass.displacement[vertex + n] : glm::vec3(0);
      given.next_row[n] = has && next_row[n] ? pass.displacement[vertex + pass.lattice.row + n] : glm::vec3(0);
    }
  }
  __device__ Plane snapped() const {
    Plane moved;
    bool certain = fast.snap<kExact>(given.row[0], moved.row[0]) & fast.snap<kExact>(given.row[1], moved.row[1]);
    certain &= fast.snap<kExact>(given.next_row[0], moved.next_row[0]) &
               fast.snap<kExact>(given.next_row[1], moved.next_row[1]);
    if (!certain) {
      moved.row[0] = snapped_slowly(pass, given.row[0], at);
      moved.row[1] = snapped_slowly(pass, given.row[1], {at.x + 1, at.y, at.z});
      moved.next_row[0] = snapped_slowly(pass, given.next_row[0], {at.x, at.y + 1, at.z});
      moved.next_row[1] = snapped_slowly(pass, given.next_row[1], {at.x + 1, at.y + 1, at.z});
    }
    return moved;
  }
};

/// A warp has 64 columns of a row and goes along k, two planes at a time. Neighbours along i are other lanes', those
/// along j and k are read or kept. Columns begin where the first of a pair is even on planes of even k.
template <bool kExact, bool kRange>
__global__ void __launch_bounds__(32 * kRows, kBlocks)
    step_pass_kernel(const __grid_constant__ StepPass pass, const __grid_constant__ FloatSnap fast, float corner_rest,
                     float centre_rest) {
  const int lane = static_cast<int>(threadIdx.x);
  const glm::ivec3& cells = pass.lattice.cells;
  Pair pair;
  pair.at = {0, blockIdx.y * kRows + threadIdx.y, blockIdx.z * kPlanes};
  pair.at.x = InvertedPairs::column(pair.at.y, blockIdx.x, lane);
  if (pair.at.y > cells.y) return;  // the whole warp
  const int end = min(pair.at.z + kPlanes, cells.z + 1);
  PlaneReader<kExact> reader{pass, fast, pair.at};
#pragma unroll
  for (int n = 0; n < 2; ++n) {
    const int i = pair.at.x + n, j = pair.at.y;
    reader.row[n] = i >= 0 && i <= cells.x;
    reader.next_row[n] = reader.row[n] && j < cells.y;
    pair.owned[n] = reader.row[n] && lane + n > 0 && lane + n < kColumns / 2;
    pair.inner[n] = i > 0 && i < cells.x && j > 0 && j < cells.y;
    pair.cell[n] = pair.owned[n] && i < cells.x && j < cells.y;
  }
  reader.vertex = static_cast<int>(pass.lattice.offset(pair.at)) - 2 * pass.lattice.slice;
  reader.at.z -= 2;
  reader.read_next();
  Plane here = reader.snapped();
  glm::vec3 before = here.row[0];
  reader.read_next();
  here = reader.snapped();
  reader.read_next();
  int vertex = reader.vertex - pass.lattice.slice;
  const auto read_below = [&](int even, int z) {
    const bool has = pair.at.y > 0 && z <= cells.z && pair.owned[even];
    return has ? pass.displacement[pass.lattice.offset({pair.at.x + even, pair.at.y - 1, z})] : glm::vec3(0);
  };
  glm::vec3 given_below = read_below(0, pair.at.z);
  Seen corners, centres;
  unsigned moves = 0;
  const auto step = [&](auto even, const glm::vec3& before, const Plane& here, Plane& above) {
    constexpr int kEven = decltype(even)::value;
    const glm::vec3 below =
        snapped_steps<kExact>(pass, fast, given_below, {pair.at.x + kEven, pair.at.y - 1, pair.at.z});
    given_below = read_below(1 - kEven, pair.at.z + 1);
    above = reader.snapped();
    reader.read_next();
    if (pass.moved) {
#pragma unroll
      for (int n = 0; n < 2; ++n) {
        if (pair.owned[n]) pass.moved[vertex + n] = here.row[n];
      }
    }
#pragma unroll
    for (const glm::vec3& v : here.row) moves |= __float_as_uint(v.x) | __float_as_uint(v.y) | __float_as_uint(v.z);
    const unsigned inverted = corners.inverted + centres.inverted;
    describe_pair<kRange, kEven>(pass, pair, before, below, here, above, corners, centres);
    const unsigned pairs = __ballot_sync(~0u, corners.inverted + centres.inverted != inverted);
    if (lane == 0) pass.inverted.words[pass.inverted.word(pair.at.y, pair.at.z, blockIdx.x)] = pairs;
    ++pair.at.z;
    vertex += pass.lattice.slice;
  };
  while (pair.at.z < end) {
    Plane above, next;
    step(std::integral_constant<int, 0>(), before, here, above);
    if (pair.at.z < end) {
      before = here.row[1];
      step(std::integral_constant<int, 1>(), before, above, next);
    }
    before = above.row[0];
    here = next;
    if (pair.at.z % MovingBlocks::kSide != 0 && pair.at.z < end) continue;
    if ((moves & 0x7FFFFFFF) != 0) {
      pass.moving.at({min(max(pair.at.x, 0), cells.x), pair.at.y, pair.at.z - 1}) = 1;
      pass.moving.at({min(max(pair.at.x + 1, 0), cells.x), pair.at.y, pair.at.z - 1}) = 1;
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
  const FloatSnap fast(pass.frame, pass.lattice);
  const auto kernel = pass.wants_range
                          ? (fast.is_exact() ? step_pass_kernel<true, true> : step_pass_kernel<false, true>)
                          : (fast.is_exact() ? step_pass_kernel<true, false> : step_pass_kernel<false, false>);
  kernel<<<blocks, dim3(32, kRows), 0, stream>>>(pass, fast, corner_rest, centre_rest);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void snap_steps(const StepPass& pass, cudaStream_t stream) {
  const std::int64_t vertices = std::int64_t{pass.lattice.slice} * (pass.lattice.cells.z + 1);
  const FloatSnap fast(pass.frame, pass.lattice);
  const auto kernel = fast.is_exact() ? snap_steps_kernel<true> : snap_steps_kernel<false>;
  kernel<<<blocks_for(vertices), kThreads, 0, stream>>>(pass, fast);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
