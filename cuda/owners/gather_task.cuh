// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/gather.cuh"
#include "cuda/runtime/warp.cuh"
#include "deform/core/coarse_map.h"
#include "deform/core/gather.h"

/// What all kernels of a gather know, and how a box is shared out among marches. For gather.cu alone.
///
///     a warp's march: 16 x 2 voxels, a lane each, and up to 64 slices       a thread block: 2 x 2 marches
///
///         j + 1   16 17 18 19 ... 31     along k: slice 0, 1, ..., 63              +--------+--------+
///         j        0  1  2  3 ... 15                                               | warp 2 | warp 3 |
///                  i            i + 15                                             +--------+--------+
///     two rows, not one: lanes read fewer cache lines where the field turns        | warp 0 | warp 1 |
///                                                                                  +--------+--------+
namespace tetwarp::cuda_detail {

namespace {

constexpr int kAlongI = 16;            ///< voxels of a warp along i
constexpr int kAlongJ = 32 / kAlongI;  ///< and along j
constexpr int kMarch = 64;             ///< voxels along k that a thread goes; a multiple of 32
constexpr int kWarps = 4;              ///< of a block
constexpr int kAcross = 2;             ///< of these side by side along i
constexpr int kSeedTile = 8;           ///< voxels along i and j that share a seed
constexpr unsigned kQueueSize = 1u << 20;

/// Where a lane's voxels are in those of its warp.
__device__ glm::ivec3 of_lane(int lane) { return {lane % kAlongI, lane / kAlongI, 0}; }

/// How many marches a box takes on each axis.
__host__ __device__ inline glm::ivec3 marches_of(const glm::ivec3& size) {
  const glm::ivec3 march(kAlongI, kAlongJ, kMarch);
  return (size + march - 1) / march;
}

/// What all kernels of a gather know.
struct GatherTask {
  StepLattice lattice;
  NudgeTurns nudge;
  SlabBox box;
  BitRows single;              ///< a bit for each voxel of the box that has one owner: from `Coverage`
  std::uint32_t* several;      ///< a bit for each that is to be claimed, laid out as `single`; the walk adds to them
  MovingBlocks moving;         ///< from `step_pass_kernel`
  std::uint8_t* resting;       ///< of each march, whether all that it needs is at rest; i fastest: from `rest_kernel`
  glm::ivec3 seeds;            ///< how many on each axis
  Gather::QueuedVoxel* queue;  ///< room for kQueueSize; the march writes, `queue_kernel` reads
  Gather::Counters* counters;
  const int4* maps = nullptr;  ///< of a coarse field, where there is a table (`map_table.cuh`)

  __device__ glm::ivec3 begin() const { return glm::ivec3(box.begin); }
  __device__ glm::ivec3 size() const { return glm::ivec3(box.size); }
  __device__ GatherPoint point(const glm::ivec3& voxel) const { return {lattice, voxel, nudge.signs(voxel)}; }
  /// Whether a tetrahedron owns a voxel, exactly; rarely called.
  __device__ __noinline__ bool owns(FloatTetrahedron t, glm::ivec3 voxel) const {
    int sides[4];
    return owns_exactly(vertices_of(lattice, as_lattice(t)), voxel * kStepsPerVoxel, nudge.signs(voxel), sides);
  }
  /// How many marches there are on each axis.
  __device__ glm::ivec3 marches() const { return marches_of(size()); }
  __device__ int march_number(const glm::ivec3& at) const {
    const glm::ivec3 count = marches();
    return (at.z * count.y + at.y) * count.x + at.x;
  }
  /// The voxel of the box that a seed is for.
  __device__ glm::ivec3 seeded(const glm::ivec3& seed) const {
    const glm::ivec3 middle(kSeedTile / 2, kSeedTile / 2, 0);
    return glm::min(seed * glm::ivec3(kSeedTile, kSeedTile, kMarch) + middle, size() - 1);
  }
  /// Leaves a voxel to the walk or, where its queue is full, to the claims.
  __device__ void put_aside(const glm::ivec3& in, const glm::vec3& place) const {
    const unsigned n = atomicAdd(&counters->queued, 1u);
    if (n < kQueueSize) {
      queue[n] = {(in.z * size().y + in.y) * size().x + in.x, place.x, place.y, place.z};
    } else {
      leave_to_claims(in);
    }
  }
  __device__ void leave_to_claims(const glm::ivec3& in) const {
    atomicOr(&several[word(in)], 1u << (in.x & 31));
    atomicAdd(&counters->left, 1u);
  }
  __device__ std::int64_t word(const glm::ivec3& in) const {
    return (std::int64_t{in.z} * size().y + in.y) * single.words_per_row + in.x / 32;
  }
};

/// Whether a sink is one of coarse fields.
template <class Sink>
constexpr bool kIsCoarse = Sink::kLerp == Lerp::fused;

/// Where a voxel of a coarse field comes from that a tetrahedron owns. Rarely called, so out of line.
__device__ __noinline__ FixedOffset fixed_offset_in(const StepLattice& lattice, LatticeTetrahedron t, glm::ivec3 voxel,
                                                    glm::i32vec3 signs) {
  return fixed_offset(coarse_u(vertices_of(lattice, t), voxel, signs));
}

/// Where a voxel comes from that a tetrahedron owns, as a sink takes it.
template <class Sink>
__device__ auto offset_for(const StepLattice& lattice, const LatticeTetrahedron& t, const glm::ivec3& voxel,
                           const glm::i32vec3& signs) {
  if constexpr (kIsCoarse<Sink>) {
    return fixed_offset_in(lattice, t, voxel, signs);
  } else {
    return offset_in(lattice, t, voxel, signs);
  }
}

/// The same of a trial that found that it owns the voxel.
template <class Sink>
__device__ auto offset_for(const GatherTask& task, const Trial& trial, const glm::ivec3& voxel) {
  if constexpr (kIsCoarse<Sink>) {
    return fixed_offset_in(task.lattice, as_lattice(trial.t), voxel, task.nudge.signs(voxel));
  } else {
    return trial.u();
  }
}

/// NaN and infinity are not.
__device__ bool is_finite(const glm::vec3& v) { return isfinite(v.x + v.y + v.z); }

}  // namespace

}  // namespace tetwarp::cuda_detail
