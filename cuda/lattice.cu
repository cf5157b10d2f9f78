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
  return {n % size.x, n / size.x % size.y, n / (size.x * size.y)};
}

__global__ void snap_kernel(LatticeFrame frame, const glm::vec3* displacement, std::int64_t vertices, Vertex* out,
                            LatticeFindings* found) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= vertices) return;
  out[n] = snapped(frame, displacement, n, vertex_at(frame, n), &found->bad_vertex);
}

__global__ void snap_steps_kernel(LatticeFrame frame, StepLattice lattice, const glm::vec3* displacement,
                                  std::int64_t vertices, glm::vec3* moved, LatticeFindings* found) {
  constexpr int kMost = 1 << 23;  // a difference of two is exact in float
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= vertices) return;
  const glm::i64vec3 at = vertex_at(frame, n);
  const Vertex vertex = snapped(frame, displacement, n, at, &found->bad_vertex);
  const glm::i32vec3 rest(lattice.first + glm::vec3(at) * lattice.cell), u = vertex.u;
  const bool near = u.x > -kMost && u.x < kMost && u.y > -kMost && u.y < kMost && u.z > -kMost && u.z < kMost;
  if (!near || vertex.deformed + u != rest) found->beside = 1;
  moved[n] = -glm::vec3(u);
}

template <class Int>
__device__ void jacobians(const Cell& cell, bool odd, double (&determinants)[kTetrahedraPerCell]) {
  if (odd) {
    cell_jacobians<Int, true>(cell, determinants);
  } else {
    cell_jacobians<Int, false>(cell, determinants);
  }
}

__global__ void statistics_kernel(DeviceField field, LatticeFindings* found, std::uint32_t* inverted) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  bool any_inverted = false;
  if (n < field.cell_count()) {
    const glm::i64vec3 at = field.cell_at(n);
    const Cell cell = field.cell(at);
    Box rest{cell.corner[0].deformed + cell.corner[0].u, cell.corner[0].deformed + cell.corner[0].u};
    for (const Vertex& corner : cell.corner) rest.grow(corner.deformed + corner.u);
    double determinants[kTetrahedraPerCell];
    if (fits_double(box_of(cell)) && fits_double(rest)) {
      jacobians<double>(cell, DeviceField::is_odd(at), determinants);
    } else {
      jacobians<Wide>(cell, DeviceField::is_odd(at), determinants);
    }
    for (const double determinant : determinants) {
      if (determinant < 0) atomicAdd(&found->inverted, 1ULL);
      if (determinant == 0) atomicAdd(&found->degenerate, 1ULL);
      any_inverted = any_inverted || determinant < 0;
      const unsigned long long key = ordered(determinant);
      if (key < found->jacobian_min) atomicMin(&found->jacobian_min, key);
      if (key > found->jacobian_max) atomicMax(&found->jacobian_max, key);
    }
  }
  const unsigned votes = __ballot_sync(~0u, any_inverted);
  if ((threadIdx.x & 31) == 0 && n < field.cell_count()) inverted[n / 32] = votes;
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

void LatticeOnDevice::snap_steps(const StepLattice& lattice, const glm::vec3* displacement, std::int64_t vertices,
                                 LatticeFindings* found, cudaStream_t stream) {
  if (lattice.cells.x == 0) return;
  glm::vec3* moved = moved_.reserve(static_cast<std::size_t>(vertices));
  snap_steps_kernel<<<blocks_for(vertices), kThreads, 0, stream>>>(field_.frame, lattice, displacement, vertices, moved,
                                                                   found);
  TETWARP_CUDA_TRY(cudaGetLastError());
  LatticeFindings seen;
  found_.download(&seen, 1, stream);
  if (seen.beside != 0) return;
  field_.steps = lattice;
  field_.steps.moved = moved;
}

void LatticeOnDevice::set(const LatticeFrame& frame, const Geometry& output, const glm::vec3* displacement,
                          cudaStream_t stream) {
  field_ = {frame, {}, nullptr};
  const glm::i64vec3 size = frame.cells + std::int64_t{1};
  const std::int64_t vertices = size.x * size.y * size.z, cells = field_.cell_count();
  LatticeFindings found{0, 0, ~0ULL, 0, ~0ULL, 0};
  found_.upload(&found, 1, stream);
  snap_steps(make_step_lattice(frame, output), displacement, vertices, found_.data(), stream);
  if (!field_.has_steps()) {
    field_.vertices = vertices_.reserve(static_cast<std::size_t>(vertices));
    snap_kernel<<<blocks_for(vertices), kThreads, 0, stream>>>(frame, displacement, vertices, vertices_.data(),
                                                               found_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
  std::uint32_t* inverted = inverted_.reserve(static_cast<std::size_t>((cells + 31) / 32));
  statistics_kernel<<<blocks_for(cells), kThreads, 0, stream>>>(field_, found_.data(), inverted);
  TETWARP_CUDA_TRY(cudaGetLastError());
  found_.download(&found, 1, stream);
  if (found.bad_vertex != ~0ULL) {
    const auto n = static_cast<std::int64_t>(found.bad_vertex);
    refuse_vertex({n % size.x, n / size.x % size.y, n / (size.x * size.y)});
  }
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
