// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>

#include "deform/resampler.h"

namespace tetwarp {

/// Distances in mm between where points should be and where they are. They are the same for any number of threads.
struct Residuals {
  std::uint64_t points = 0;  ///< number of points that were compared
  double mean = 0;           ///< mean distance, mm
  /// A distance, mm, that at least 99 % of the points do not exceed; rounded up by at most 1 %.
  double percentile_99 = 0;
  double largest = 0;  ///< largest distance, mm
};

/// Takes each sample of an inverse (LPS mm; NaN where nothing maps) to its undeformed place, and forward again by the
/// piecewise affine map that a resampler onto the grid of the inverse uses. What remains is due to rounding the inverse
/// to float and vertices to 2^-12 voxel.
Residuals forward_after_inverse(const VertexField& field, const PullField& inverse, const Limits& limits = {},
                                const Control& control = {});

/// Takes each vertex of a field to where it goes, and back by the inverse, interpolated trilinearly between its samples
/// as other programs do. Vertices that come to lie where one of the eight samples is missing are left out. What remains
/// is what a grid of samples cannot represent of a piecewise affine map.
Residuals inverse_after_forward(const VertexField& field, const PullField& inverse, const Limits& limits = {},
                                const Control& control = {});

/// Both residuals of an inverse that arrives slab by slab: only one slab and the slice before it are held. The results
/// are those of `forward_after_inverse` and `inverse_after_forward` on the whole inverse; only the mean of
/// `inverse_after_forward` may round differently, depending on the split.
class InverseCheck {
 public:
  /// @param field   field in host memory, which must outlive this object unchanged
  /// @param grid    grid of the inverse
  /// @param limits  number of threads
  InverseCheck(const VertexField& field, const Geometry& grid, const Limits& limits = {});
  /// Frees the search structure and the slice that is held.
  ~InverseCheck();

  /// Adds the next slices.
  /// @param slices   `Maps::inverse_mm` in host memory: whole slices in rising order, each once
  /// @param control  only its stop is used
  /// @throws InputError for other slices than the next ones
  /// @throws Cancelled
  void add(const ConstVolumeView& slices, const Control& control = {});

  /// The residuals of all samples of the slices added so far.
  Residuals forward_after_inverse() const;
  /// The residuals of all vertices that come to lie in or between the slices added so far.
  Residuals inverse_after_forward() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Both residuals of an inverse that never exists as a whole: measured on pairs of slices of the output grid, spread
/// evenly along k.
struct RoundTrip {
  /// Most slices that are looked at, 12 bytes a voxel (50 MB at 512 x 512). Of an output with fewer slices all are.
  static constexpr std::int64_t kMostSlices = 16;

  std::uint64_t slices = 0,         ///< slices of the output that were looked at
      voxels = 0;                   ///< voxels in these slices
  double step_mm = 0;               ///< step to which vertices are rounded, mm: 2^-12 of the longest edge of a voxel
  Residuals forward_after_inverse;  ///< residuals of the samples in these slices
  /// Residuals of the vertices that come to lie in one of these slices, or between the two of a pair.
  Residuals inverse_after_forward;
};

/// Measures both residuals of a field that a resampler holds. Every backend, with any number of threads, looks at the
/// same voxels and vertices and gives the same result.
///
/// @param resampler  its field must be `field`, and stays set
/// @param field      the same field in host memory
/// @param limits     number of threads
/// @param control    only its stop and stream are used
/// @throws InputError and others, as `Resampler::resample`
RoundTrip measure_round_trip(ForwardResampler& resampler, const VertexField& field, const Limits& limits = {},
                             const Control& control = {});

}  // namespace tetwarp
