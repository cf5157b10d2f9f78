// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>

#include "deform/resampler.h"

namespace tetwarp {

/// Distances, mm, between where points should be and where they are. The same for any number of threads.
struct Residuals {
  std::uint64_t points = 0;  ///< that were compared
  double mean = 0;
  double percentile_99 = 0;  ///< that at least 99 % do not exceed, to within 1 %
  double largest = 0;
};

/// From each sample of an inverse (LPS mm; NaN where nothing maps) to its undeformed place, and forward again by the
/// piecewise affine map that a resampler onto the inverse's grid sees.
///
/// What is left is what rounding the inverse to float and to 2^-12 voxel takes.
Residuals forward_after_inverse(const VertexField& field, const PullField& inverse, const Limits& limits = {},
                                const Control& control = {});

/// From each vertex of a field to where it goes, and back by the inverse, interpolated between its samples as other
/// programs do (trilinear). Vertices that come to lie where one of eight samples is missing are left out.
///
/// What is left is what a grid of samples cannot say of a piecewise affine map.
Residuals inverse_after_forward(const VertexField& field, const PullField& inverse, const Limits& limits = {},
                                const Control& control = {});

/// Both residuals of all of an inverse that comes slab by slab, so that no more of it is held than a slab and the slice
/// before. The numbers are those of the whole inverse; only `mean` of the way back may round otherwise, by the split.
class InverseCheck {
 public:
  /// @param field  in host memory; must stay as it is
  /// @param grid   of the inverse
  InverseCheck(const VertexField& field, const Geometry& grid, const Limits& limits = {});
  ~InverseCheck();

  /// @param slices   `Maps::inverse_mm`, in host memory: whole slices, from the first on, each once
  /// @param control  stop; progress is not told
  /// @throws InputError for other slices than the next ones; Cancelled
  void add(const ConstVolumeView& slices, const Control& control = {});

  /// Of the slices that were added; of the vertices that come to lie in or between them.
  Residuals forward_after_inverse() const;
  Residuals inverse_after_forward() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Both residuals, of an inverse that is never whole: of slices of the output grid in pairs, spread evenly along k.
struct RoundTrip {
  static constexpr std::int64_t kMostSlices = 16;  ///< 12 bytes a voxel: 50 MB at 512 x 512; few slices: all

  std::uint64_t slices = 0, voxels = 0;  ///< of the output, that were looked at
  double step_mm = 0;                    ///< to what vertices are rounded: 2^-12 of the longest edge of a voxel
  Residuals forward_after_inverse;       ///< of the samples in these slices
  Residuals inverse_after_forward;       ///< of the vertices that come to lie in a slice or between the two of a pair
};

/// Looks at the same voxels and vertices, and gives the same, for every backend and any number of threads.
///
/// @param resampler  holds `field`; what it was given stays
/// @param field      in host memory
/// @param control    stop and stream; progress is not told
/// @throws what `Resampler::resample` throws
RoundTrip measure_round_trip(Resampler& resampler, const VertexField& field, const Limits& limits = {},
                             const Control& control = {});

}  // namespace tetwarp
