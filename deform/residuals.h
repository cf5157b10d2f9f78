#pragma once

#include <cstdint>

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

}  // namespace tetwarp
