// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <cstring>

#include "cuda/lattice/lattice.h"

namespace tetwarp::cuda_detail {

/// What the passes over vertices and cells find. All zero: nothing yet.
struct LatticeFindings {
  unsigned long long inverted, degenerate;
  unsigned long long not_least, most;  ///< Jacobian determinants as `ordered` keys; of the smallest, the complement
  unsigned long long not_bad_vertex;   ///< complement of the number of the first vertex that cannot be used
  unsigned long long beside;  ///< not 0: some vertex does not rest at a whole step, or moved too far for floats
  unsigned long long wide;    ///< not 0: some vertex moved further than the lattice's packing holds
};

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

/// Smallest and largest of a warp go to the findings; only where they are news.
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

/// The snapped vertex; one that cannot be used is noted.
__device__ inline Vertex snapped(const LatticeFrame& frame, const glm::vec3& displacement, const glm::i64vec3& at,
                                 std::int64_t number, LatticeFindings* found) {
  Vertex vertex;
  if (!frame.snap_vertex(at, displacement, vertex))
    atomicMax(&found->not_bad_vertex, ~static_cast<unsigned long long>(number));
  return vertex;
}

}  // namespace tetwarp::cuda_detail
