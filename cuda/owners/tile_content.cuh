// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <climits>
#include <cmath>
#include <span>

#include "cuda/runtime/device_buffer.h"
#include "deform/core/step_lattice.h"
#include "deform/resampler.h"

/// What tiles contain, so that those in which nothing is seen need not be made (`ForwardResampler::update`).
namespace tetwarp::cuda_detail {

/// The least and the largest of some whole numbers.
struct ValueHull {
  int least = INT_MAX, most = INT_MIN;  ///< of no number

  __device__ bool meets(const ValueRange& range) const {
    return static_cast<float>(least) <= range.high && range.low <= static_cast<float>(most);
  }
};

/// Values that are seen.
struct SeenRanges {
  static constexpr int kMost = 8;

  int count = 0;
  ValueRange ranges[kMost];

  /// @param values  rising; all that have no place of their own, and those between them, belong to the last range
  static SeenRanges of(std::span<const ValueRange> values) {
    SeenRanges seen;
    for (const ValueRange& range : values) {
      if (seen.count < kMost) {
        seen.ranges[seen.count++] = range;
      } else {
        seen.ranges[kMost - 1].high = range.high;
      }
    }
    return seen;
  }
  __device__ bool meet(const ValueHull& hull) const {
    bool any = false;
    for (int n = 0; n < count; ++n) any = any || hull.meets(ranges[n]);
    return any;
  }
};

/// What is put into the tiles, and what of it is seen.
struct SeenSource {
  ConstVolumeView source;              ///< whole numbers of 16 bits at most, on the device, on the grid of the tiles
  double background;                   ///< of voxels that nobody owns, before it is rounded
  std::span<const ValueRange> values;  ///< rising

  ValueHull nobody() const {
    return {static_cast<int>(std::floor(background)), static_cast<int>(std::ceil(background))};
  }
};

/// Finds the values that tetrahedra of each cell of a lattice bring where they own voxels: those around its undeformed
/// place, as linear samples and their rounding errors go.
/// @param hulls  of each cell, i fastest: written
void find_content(const StepLattice& lattice, const SeenSource& seen, ValueHull* hulls, cudaStream_t stream);

}  // namespace tetwarp::cuda_detail
