// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <cstring>

#include "cuda/lattice/lattice.cuh"

namespace tetwarp::cuda_detail {

/// What the passes over vertices and cells of a field find. All zero means: nothing yet.
struct LatticeFindings {
  unsigned long long inverted, degenerate;
  /// Smallest and largest Jacobian determinant as `ordered` keys; of the smallest the bitwise complement, so that
  /// atomicMax finds both.
  unsigned long long not_least, most;
  unsigned long long not_bad_vertex;  ///< complement of the number of the first vertex that cannot be used
  /// Not 0 if some undeformed vertex lies at no whole step, or a vertex moved too far for floats.
  unsigned long long beside;
  unsigned long long wide;  ///< not 0 if some vertex moved further than the packing of the lattice holds
};

/// Maps a double to an integer so that order is kept. Integer atomics then find the smallest and largest double.
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

/// Adds the smallest and largest value of a warp to the findings, if they change them.
__device__ inline void note_range(float least, float most, LatticeFindings* found) {
  for (int step = 16; step > 0; step /= 2) {
    least = fminf(least, __shfl_xor_sync(~0u, least, step));
    most = fmaxf(most, __shfl_xor_sync(~0u, most, step));
  }
  if ((threadIdx.x & 31) != 0 || least > most) return;
  if (~ordered(least) > found->not_least) atomicMax(&found->not_least, ~ordered(least));
  if (ordered(most) > found->most) atomicMax(&found->most, ordered(most));
}

__device__ inline void note_counts(unsigned inverted, unsigned degenerate, LatticeFindings* found) {
  inverted = warp_sum(inverted);
  degenerate = warp_sum(degenerate);
  if ((threadIdx.x & 31) != 0) return;
  if (inverted != 0) atomicAdd(&found->inverted, static_cast<unsigned long long>(inverted));
  if (degenerate != 0) atomicAdd(&found->degenerate, static_cast<unsigned long long>(degenerate));
}

/// A snapped vertex. A vertex that cannot be used is added to the findings.
__device__ inline Vertex snapped(const LatticeFrame& frame, const glm::vec3& displacement, const glm::i64vec3& at,
                                 std::int64_t number, LatticeFindings* found) {
  Vertex vertex;
  if (!frame.snap_vertex(at, displacement, vertex))
    atomicMax(&found->not_bad_vertex, ~static_cast<unsigned long long>(number));
  return vertex;
}

}  // namespace tetwarp::cuda_detail
