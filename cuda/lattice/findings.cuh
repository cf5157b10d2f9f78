// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <cstring>

#include "cuda/lattice/lattice.cuh"
#include "cuda/runtime/warp.cuh"

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

constexpr unsigned long long kSignBit = 1ULL << 63;  ///< of a double

/// Maps a double to an integer so that order is kept. Integer atomics then find the smallest and largest double.
///
/// The bits of a positive double are in the order of its values: setting the sign puts them into the upper half of all
/// integers. Those of a negative one are in the opposite order: their complement turns it round, in the lower half.
__host__ __device__ inline unsigned long long ordered(double value) {
  unsigned long long bits;
  memcpy(&bits, &value, sizeof bits);
  return (bits & kSignBit) != 0 ? ~bits : bits | kSignBit;
}
inline double from_ordered(unsigned long long key) {
  const unsigned long long bits = (key & kSignBit) != 0 ? key & ~kSignBit : ~key;
  double value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

/// Adds the smallest and largest value of a warp to the findings, if they change them.
__device__ inline void note_range(float least, float most, LatticeFindings* found) {
  least = warp_min(least);
  most = warp_max(most);
  if (lane_of_warp() != 0 || least > most) return;
  if (~ordered(least) > found->not_least) atomicMax(&found->not_least, ~ordered(least));
  if (ordered(most) > found->most) atomicMax(&found->most, ordered(most));
}

/// Adds what the threads of a warp have counted to the findings.
__device__ inline void note_counts(unsigned inverted, unsigned degenerate, LatticeFindings* found) {
  warp_add(&found->inverted, inverted);
  warp_add(&found->degenerate, degenerate);
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
