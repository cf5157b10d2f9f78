#include <cstring>

#include "cuda/lattice.h"
#include "deform/core/visit_cell.h"
#include "deform/field_check.h"

namespace tetwarp::cuda_detail {

/// What the passes over vertices and cells find.
struct LatticeFindings {
  unsigned long long inverted, degenerate, jacobian_min, jacobian_max, bad_vertex;
  unsigned beside;  ///< vertices that do not rest at whole steps, or moved too far for floats
};

namespace {

/// Doubles as integers of the same order, so that integer atomics find the smallest and largest.
__host__ __device__ inline unsigned long long ordered(double value) {
  unsigned long long bits;
  memcpy(&bits, &value, sizeof bits);
  return bits >> 63 ? ~bits : bits | (1ULL << 63);
}
inline double from_ordered(unsigned long long key) {
  const unsigned long long bits = key >> 63 ? key & ~(1ULL << 63) : ~key;
  double value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

__device__ Vertex snapped(const LatticeFrame& frame, const glm::vec3* displacement, std::int64_t n,
                          const glm::i64vec3& at, unsigned long long* bad) {
  Vertex vertex;
  if (!frame.snap_vertex(at, displacement[n], vertex)) atomicMin(bad, static_cast<unsigned long long>(n));
  return vertex;
}

__device__ glm::i64vec3 vertex_at(const LatticeFrame& frame, std::int64_t n) {
  const glm::i64vec3 size = frame.cells + std::int64_t{1};
  return unravel(n, size);
}

__global__ void snap_kernel(LatticeFrame frame, const glm::vec3* displacement, std::int64_t vertices, Vertex* out,
                            LatticeFindings* found) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= vertices) return;
  out[n] = snapped(frame, displacement, n, vertex_at(frame, n), &found->bad_vertex);
}

__global__ void snap_steps_kernel(LatticeFrame frame, StepLattice lattice, const glm::vec3* displacement,
                                  glm::vec3* moved, LatticeFindings* found) {
  constexpr int kMost = 1 << 22;  // a difference of two, and a cell, is exact in float
  const glm::i64vec3 at(blockIdx.x * kThreads + threadIdx.x, blockIdx.y, blockIdx.z);
  if (at.x > lattice.cells.x) return;
  const std::int64_t n = lattice.offset(glm::ivec3(at));
  const Vertex vertex = snapped(frame, displacement, n, at, &found->bad_vertex);
  const glm::i32vec3 rest(lattice.first + glm::vec3(at) * lattice.cell), u = vertex.u;
  const bool near = u.x > -kMost && u.x < kMost && u.y > -kMost && u.y < kMost && u.z > -kMost && u.z < kMost;
  if (!near || vertex.deformed + u != rest) found->beside = 1;
  if (moved) moved[n] = -glm::vec3(u);
}

/// Smallest and largest of a warp go to the findings; only where they are news.
__device__ void note_range(float least, float most, LatticeFindings* found) {
  for (int step = 16; step > 0; step /= 2) {
    least = fminf(least, __shfl_xor_sync(~0u, least, step));
    most = fmaxf(most, __shfl_xor_sync(~0u, most, step));
  }
  if ((threadIdx.x & 31) != 0) return;
  if (ordered(least) < found->jacobian_min) atomicMin(&found->jacobian_min, ordered(least));
  if (ordered(most) > found->jacobian_max) atomicMax(&found->jacobian_max, ordered(most));
}

__device__ void note_counts(unsigned inverted, unsigned degenerate, LatticeFindings* found) {
  inverted = warp_sum(inverted);
  degenerate = warp_sum(degenerate);
  if ((threadIdx.x & 31) != 0) return;
  if (inverted != 0) atomicAdd(&found->inverted, static_cast<unsigned long long>(inverted));
  if (degenerate != 0) atomicAdd(&found->degenerate, static_cast<unsigned long long>(degenerate));
}

/// One warp 32 cells of a row; any lattice.
__global__ void describe_kernel(DeviceField field, LatticeFindings* found) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  float least = INFINITY, most = -INFINITY;
  unsigned inverted = 0, degenerate = 0;
  if (n < field.cell_count()) {
    const glm::i64vec3 at = field.cell_at(n);
    float jacobians[kTetrahedraPerCell];
    cell_jacobians(field.cell(at), DeviceField::is_odd(at), jacobians);
    for (const float jacobian : jacobians) {
      inverted += jacobian < 0;
      degenerate += jacobian == 0;
      least = fminf(least, jacobian);
      most = fmaxf(most, jacobian);
    }
  }
  note_range(least, most, found);
  note_counts(inverted, degenerate, found);
}

constexpr int kDescribed = 16;  ///< cells along k that a thread goes, two side by side along i
constexpr int kRows = 4;        ///< of a thread block

/// What a thread has seen of one kind of tetrahedron.
struct Seen {
  float least = INFINITY, most = -INFINITY;
  unsigned inverted = 0, degenerate = 0;

  /// @param volume  with the sign of the undeformed one taken out
  __device__ void add(float volume) {
    least = fminf(least, volume);
    most = fmaxf(most, volume);
    if (volume <= 0) {
      inverted += volume < 0;
      degenerate += volume == 0;
    }
  }
};

/// Adds the five tetrahedra of a cell. @param m0 to m7  how far its corners moved
template <bool kOdd>
__device__ void add_cell(const glm::vec3& cell, const glm::vec3& m0, const glm::vec3& m1, const glm::vec3& m2,
                         const glm::vec3& m3, const glm::vec3& m4, const glm::vec3& m5, const glm::vec3& m6,
                         const glm::vec3& m7, Seen& corners, Seen& centres) {
  const glm::vec3 p[8] = {m0,
                          {m1.x + cell.x, m1.y, m1.z},
                          {m2.x, m2.y + cell.y, m2.z},
                          {m3.x + cell.x, m3.y + cell.y, m3.z},
                          {m4.x, m4.y, m4.z + cell.z},
                          {m5.x + cell.x, m5.y, m5.z + cell.z},
                          {m6.x, m6.y + cell.y, m6.z + cell.z},
                          {m7.x + cell.x, m7.y + cell.y, m7.z + cell.z}};
#pragma unroll
  for (int number = 0; number < kTetrahedraPerCell; ++number) {
    const TetrahedronCorners of = tetrahedron_corners(number, kOdd);
    const float volume = detail::edge_determinant(p[of.a] - p[of.d], p[of.b] - p[of.d], p[of.c] - p[of.d]);
    if (number == 0) {
      centres.add(kOdd ? volume : -volume);
    } else {
      corners.add(kOdd ? -volume : volume);
    }
  }
}

/// The same for whole steps: volumes of a kind share their rest volume, so the division waits until the end. A thread
/// has two cells of a row side by side, one even and one odd, so that threads do not part over parity.
__global__ void __launch_bounds__(32 * kRows)
    describe_steps_kernel(StepLattice lattice, float corner_rest, float centre_rest, LatticeFindings* found,
                          std::uint32_t* inverted_cells, int words_per_row) {
  const glm::ivec3 at(blockIdx.x * 64 + 2 * threadIdx.x, blockIdx.y * kRows + threadIdx.y, blockIdx.z * kDescribed);
  if (at.y >= lattice.cells.y) return;  // the whole warp
  const bool here = at.x < lattice.cells.x, next_too = at.x + 1 < lattice.cells.x;
  const int x = here ? at.x : lattice.cells.x - 1, step = here && next_too ? 2 : 1;  // stay within the row
  const glm::vec3* row = lattice.moved + lattice.offset({x, at.y, at.z});
  const int last = min(at.z + kDescribed, lattice.cells.z);
  const auto load = [&](glm::vec3(&plane)[6]) {
    plane[0] = row[0];
    plane[1] = row[1];
    plane[2] = row[step];
    plane[3] = row[lattice.row];
    plane[4] = row[lattice.row + 1];
    plane[5] = row[lattice.row + step];
  };
  glm::vec3 a[6], b[6];
  load(a);
  Seen corners, centres;
  unsigned inverted = 0;
  for (int z = at.z; z < last; ++z) {
    row += lattice.slice;
    load(b);
    Seen first_corners = corners, first_centres = centres;
    const glm::vec3& cell = lattice.cell;
    if (((at.y + z) & 1) == 0) {
      add_cell<false>(cell, a[0], a[1], a[3], a[4], b[0], b[1], b[3], b[4], first_corners, first_centres);
      corners = first_corners;
      centres = first_centres;
      if (next_too) add_cell<true>(cell, a[1], a[2], a[4], a[5], b[1], b[2], b[4], b[5], corners, centres);
    } else {
      add_cell<true>(cell, a[0], a[1], a[3], a[4], b[0], b[1], b[3], b[4], first_corners, first_centres);
      corners = first_corners;
      centres = first_centres;
      if (next_too) add_cell<false>(cell, a[1], a[2], a[4], a[5], b[1], b[2], b[4], b[5], corners, centres);
    }
    const unsigned before = inverted;
    inverted = corners.inverted + centres.inverted;
    const unsigned of_first = first_corners.inverted + first_centres.inverted;
    const unsigned first_votes = __ballot_sync(~0u, here && of_first != before);
    const unsigned second_votes = __ballot_sync(~0u, next_too && inverted != of_first);
    if (threadIdx.x == 0) {
      std::uint32_t* words =
          inverted_cells + (std::int64_t{z} * lattice.cells.y + at.y) * words_per_row + 2 * blockIdx.x;
      words[0] = first_votes;
      words[1] = second_votes;
    }
#pragma unroll
    for (int n = 0; n < 6; ++n) a[n] = b[n];
  }
  if (!here) corners = centres = {};
  note_range(corners.least / corner_rest + 0.0f, corners.most / corner_rest + 0.0f, found);
  note_range(centres.least / centre_rest + 0.0f, centres.most / centre_rest + 0.0f, found);
  note_counts(corners.inverted + centres.inverted, corners.degenerate + centres.degenerate, found);
}

__global__ void reach_kernel(DeviceField field, VoxelBox region, int* low_high) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= field.cell_count()) return;
  const Cell cell = field.cell(field.cell_at(n));
  if (detail::is_empty(detail::candidates(field.frame.nudge, box_of(cell), region))) return;
  for (const Vertex& vertex : cell.corner) {
    const glm::i32vec3 rest = vertex.deformed + vertex.u;
    for (int axis = 0; axis < 3; ++axis) {
      if (rest[axis] < low_high[axis]) atomicMin(&low_high[axis], rest[axis]);
      if (rest[axis] > low_high[3 + axis]) atomicMax(&low_high[3 + axis], rest[axis]);
    }
  }
}

}  // namespace

void LatticeOnDevice::snap_steps(const StepLattice& lattice, const glm::vec3* displacement, glm::vec3* moved,
                                 LatticeFindings* found, cudaStream_t stream) {
  const dim3 blocks(blocks_for(lattice.row), static_cast<unsigned>(lattice.cells.y + 1),
                    static_cast<unsigned>(lattice.cells.z + 1));
  const bool in_place = moved == displacement;  // look first: what is not at whole steps needs its displacement
  snap_steps_kernel<<<blocks, kThreads, 0, stream>>>(field_.frame, lattice, displacement, in_place ? nullptr : moved,
                                                     found);
  TETWARP_CUDA_TRY(cudaGetLastError());
  LatticeFindings seen;
  found_.download(&seen, 1, stream);
  if (seen.beside != 0) return;
  if (in_place) snap_steps_kernel<<<blocks, kThreads, 0, stream>>>(field_.frame, lattice, displacement, moved, found);
  field_.steps = lattice;
  field_.steps.moved = moved;
}

void LatticeOnDevice::describe(LatticeFindings* found, cudaStream_t stream) {
  if (!field_.has_steps()) {
    describe_kernel<<<blocks_for(field_.cell_count()), kThreads, 0, stream>>>(field_, found);
  } else {
    const StepLattice& lattice = field_.steps;
    const glm::vec3 x(lattice.cell.x, 0, 0), y(0, lattice.cell.y, 0), z(0, 0, lattice.cell.z);
    const float corner = detail::edge_determinant(x, y, z), centre = detail::edge_determinant(y + z, x + z, x + y);
    words_per_row_ = (lattice.cells.x + 63) / 64 * 2;
    const std::size_t words = std::size_t(words_per_row_) * std::size_t(lattice.cells.y) * std::size_t(lattice.cells.z);
    const dim3 blocks(static_cast<unsigned>(words_per_row_ / 2),
                      static_cast<unsigned>((lattice.cells.y + kRows - 1) / kRows),
                      static_cast<unsigned>((lattice.cells.z + kDescribed - 1) / kDescribed));
    describe_steps_kernel<<<blocks, dim3(32, kRows), 0, stream>>>(lattice, corner, centre, found,
                                                                  inverted_.reserve(words), words_per_row_);
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void LatticeOnDevice::set(const LatticeFrame& frame, const Geometry& output, const glm::vec3* displacement,
                          glm::vec3* room, cudaStream_t stream) {
  field_ = {frame, {}, nullptr};
  const glm::i64vec3 size = frame.cells + std::int64_t{1};
  const std::int64_t vertices = size.x * size.y * size.z;
  LatticeFindings found{0, 0, ~0ULL, 0, ~0ULL, 0};
  found_.upload(&found, 1, stream);
  const StepLattice steps = make_step_lattice(frame, output);
  if (steps.cells.x != 0) {
    if (!room) room = moved_.reserve(static_cast<std::size_t>(vertices));
    snap_steps(steps, displacement, room, found_.data(), stream);
  }
  if (!field_.has_steps()) {
    field_.vertices = vertices_.reserve(static_cast<std::size_t>(vertices));
    snap_kernel<<<blocks_for(vertices), kThreads, 0, stream>>>(frame, displacement, vertices, vertices_.data(),
                                                               found_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
  describe(found_.data(), stream);
  found_.download(&found, 1, stream);
  if (found.bad_vertex != ~0ULL) refuse_vertex(unravel(static_cast<std::int64_t>(found.bad_vertex), size));
  statistics_ = {found.inverted, found.degenerate, from_ordered(found.jacobian_min), from_ordered(found.jacobian_max)};
}

void LatticeOnDevice::reach(const glm::i64vec3& begin, const glm::i64vec3& end, int (&low_high)[6],
                            cudaStream_t stream) const {
  for (int axis = 0; axis < 3; ++axis) {
    low_high[axis] = INT32_MAX;
    low_high[3 + axis] = INT32_MIN;
  }
  DeviceBuffer<int> found;
  found.upload(low_high, 6, stream);
  reach_kernel<<<blocks_for(field_.cell_count()), kThreads, 0, stream>>>(field_, {begin, end}, found.data());
  TETWARP_CUDA_TRY(cudaGetLastError());
  found.download(low_high, 6, stream);
}

}  // namespace tetwarp::cuda_detail
