// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/lattice/findings.cuh"
#include "cuda/lattice/step_pass.cuh"
#include "cuda/runtime/fetch.h"
#include "deform/core/visit_cell.h"
#include "deform/field_check.h"

namespace tetwarp::cuda_detail {

namespace {

/// Snaps the vertices of any lattice; a thread a vertex.
///
/// @param displacement  mm, one for each vertex, i fastest  @param vertices  how many
/// @param out           one for each vertex: written  @param found  gets the first vertex that cannot be used
__global__ void snap_kernel(LatticeFrame frame, const glm::vec3* displacement, std::int64_t vertices, Vertex* out,
                            LatticeFindings* found) {
  const std::int64_t n = thread_of_grid();
  if (n < vertices) out[n] = snapped(frame, displacement[n], unravel(n, frame.cells + std::int64_t{1}), n, found);
}

/// Jacobian determinants of any lattice; a thread a cell.
///
/// @param field  with vertices in either form  @param found  gets counts and the range: once a warp, by atomics
__global__ void describe_kernel(DeviceField field, LatticeFindings* found) {
  const std::int64_t n = thread_of_grid();
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

/// Box around the undeformed places of the cells that may reach a region; a thread a cell.
///
/// @param region    half open, voxels of the output
/// @param low_high  low and high corner, 2^-12 voxel, three numbers each: widened by atomics, after a look that mostly
///                  shows that they need not be
__global__ void reach_kernel(DeviceField field, Region region, int* low_high) {
  const std::int64_t n = thread_of_grid();
  if (n >= field.cell_count()) return;
  const Cell cell = field.cell(field.cell_at(n));
  if (is_empty(detail::candidates(field.frame.nudge, box_of(cell), region))) return;
  for (const Vertex& vertex : cell.corner) {
    const glm::i32vec3 rest = vertex.deformed + vertex.u;
    for (int axis = 0; axis < 3; ++axis) {
      if (rest[axis] < low_high[axis]) atomicMin(&low_high[axis], rest[axis]);
      if (rest[axis] > low_high[3 + axis]) atomicMax(&low_high[3 + axis], rest[axis]);
    }
  }
}

}  // namespace

LatticeFindings* LatticeOnDevice::clear_notes(std::size_t words, std::size_t bytes, cudaStream_t stream) {
  notes_.fill(0, sizeof(LatticeFindings) + words * sizeof(std::uint32_t) + bytes, stream);
  return reinterpret_cast<LatticeFindings*>(notes_.data());
}

LatticeFindings LatticeOnDevice::read_findings(cudaStream_t stream) { return fetch(notes_.data(), found_, stream); }

/// @return whether all vertices rest at whole steps, and can be packed
bool LatticeOnDevice::set_steps(StepLattice lattice, const glm::vec3* displacement, std::uint64_t* room,
                                bool wants_range, LatticeFindings& found, cudaStream_t stream) {
  if (lattice.cells.x == 0) return false;
  const auto vertices = static_cast<std::size_t>(lattice.slice) * static_cast<std::size_t>(lattice.cells.z + 1);
  if (!room) room = packed_.reserve(vertices);
  const bool in_place = static_cast<const void*>(room) == displacement;  // look first, pack then
  inverted_ = InvertedPairs(lattice);
  const auto words = static_cast<std::size_t>(inverted_.word(0, lattice.cells.z + 1, 0));
  blocks_.count = lattice.cells / MovingBlocks::kSide + 1;
  const auto blocks = static_cast<std::size_t>(std::int64_t{blocks_.count.x} * blocks_.count.y * blocks_.count.z);
  StepPass pass{field_.frame, lattice, displacement, in_place ? nullptr : room, {}, {}, nullptr, wants_range};
  const auto look = [&] {
    pass.lattice.packing = packing_;
    pass.found = clear_notes(words, blocks, stream);
    inverted_.words = reinterpret_cast<std::uint32_t*>(pass.found + 1);
    blocks_.moving = reinterpret_cast<std::uint8_t*>(inverted_.words + words);
    pass.inverted = inverted_;
    pass.moving = blocks_;
    run_step_pass(pass, stream);
    found = read_findings(stream);
    return found.beside == 0 && found.not_bad_vertex == 0;
  };
  if (!look()) return false;
  if (found.wide != 0) {
    const int nothing[6] = {INT32_MAX, INT32_MAX, INT32_MAX, INT32_MIN, INT32_MIN, INT32_MIN};
    int low_high[6];
    range_.upload(nothing, 6, stream);
    find_range(pass, range_.data(), stream);
    range_.download(low_high, 6, stream);
    const std::optional<StepPacking> packing =
        StepPacking::holding({low_high[0], low_high[1], low_high[2]}, {low_high[3], low_high[4], low_high[5]});
    if (!packing) return false;
    packing_ = *packing;
    if (!look() || found.wide != 0) return false;
  }
  if (in_place) {
    pass.packed = room;
    pack_in_place(pass, stream);
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));  // the next call may come on another stream
  }
  field_.steps = pass.lattice;
  field_.steps.packed = room;
  return true;
}

void LatticeOnDevice::set_vertices(const glm::vec3* displacement, std::int64_t vertices, LatticeFindings& found,
                                   cudaStream_t stream) {
  LatticeFindings* on_device = clear_notes(0, 0, stream);
  field_.vertices = vertices_.reserve(static_cast<std::size_t>(vertices));
  snap_kernel<<<blocks_for(vertices), kThreads, 0, stream>>>(field_.frame, displacement, vertices, vertices_.data(),
                                                             on_device);
  describe_kernel<<<blocks_for(field_.cell_count()), kThreads, 0, stream>>>(field_, on_device);
  TETWARP_CUDA_TRY(cudaGetLastError());
  found = read_findings(stream);
}

void LatticeOnDevice::set(const LatticeFrame& frame, const Geometry& output, const glm::vec3* displacement,
                          std::uint64_t* room, bool wants_range, cudaStream_t stream) {
  field_ = {frame, {}, nullptr};
  const glm::i64vec3 size = frame.cells + std::int64_t{1};
  LatticeFindings found;
  if (!set_steps(make_step_lattice(frame, output), displacement, room, wants_range, found, stream))
    set_vertices(displacement, size.x * size.y * size.z, found, stream);
  if (found.not_bad_vertex != 0)
    refuse_vertex(unravel(static_cast<std::int64_t>(~found.not_bad_vertex), size) +
                  glm::i64vec3(0, 0, frame.first_slice));
  statistics_ = {found.inverted, found.degenerate};
  if (!wants_range) return;
  statistics_.jacobian_min = from_ordered(~found.not_least);
  statistics_.jacobian_max = from_ordered(found.most);
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
