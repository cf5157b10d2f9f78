// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "cuda/runtime/device_buffer.h"
#include "deform/core/step_lattice.h"
#include "deform/resampler.h"

/// What tiles contain, so that those in which nothing is seen need not be made (`ForwardResampler::update`).
namespace tetwarp::cuda_detail {

/// The least and the largest of some values, as whole numbers in the same order: atomics find them.
struct ValueHull {
  unsigned least = ~0u, most = 0;  ///< of no value

  __host__ __device__ static unsigned sorted(float value) {
    const auto bits = std::bit_cast<unsigned>(value + 0.0f);  // -0 is 0
    return bits >> 31 != 0 ? ~bits : bits | 1u << 31;
  }
  __host__ __device__ static ValueHull of(float least, float most) { return {sorted(least), sorted(most)}; }
  __host__ __device__ bool meets(const ValueHull& other) const { return least <= other.most && other.least <= most; }
};

/// Values that are seen.
struct SeenHulls {
  static constexpr int kMost = 8;

  int count = 0;
  ValueHull hulls[kMost];

  /// @param values  rising; all that have no place of their own, and those between them, belong to the last hull
  static SeenHulls of(std::span<const ValueRange> values) {
    SeenHulls seen;
    for (const ValueRange& range : values) {
      const ValueHull hull = ValueHull::of(range.low, range.high);
      if (seen.count < kMost) {
        seen.hulls[seen.count++] = hull;
      } else {
        seen.hulls[kMost - 1].most = std::max(seen.hulls[kMost - 1].most, hull.most);
      }
    }
    return seen;
  }
  __device__ bool meet(const ValueHull& hull) const {
    bool any = false;
    for (int n = 0; n < count; ++n) any = any || hull.meets(hulls[n]);
    return any;
  }
};

/// What is put into the tiles, and what of it is seen.
struct SeenSource {
  ConstVolumeView source;          ///< whole numbers, in memory of the device, on the whole grid of the tiles' box
  float background;                ///< of voxels that nobody owns
  std::vector<ValueRange> values;  ///< rising
};

/// Finds the values that tetrahedra of each cell of a lattice bring where they own voxels: those around its undeformed
/// place, as linear samples and their rounding errors go.
/// @param hulls  of each cell, i fastest: written
void find_content(const StepLattice& lattice, const SeenSource& seen, ValueHull* hulls, cudaStream_t stream);

}  // namespace tetwarp::cuda_detail
