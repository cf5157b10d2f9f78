// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <span>
#include <vector>

#include "deform/contours/contour_stack.h"
#include "deform/volume.h"

namespace tetwarp {

/// A deformed solid on one slice of the output.
struct SlicedContours {
  std::vector<Contour> contours;  ///< in the slice's plane; holes by keyholes
  double area = 0;                ///< mm2
  bool cut = false;               ///< whether the solid continues beyond the output, or to where the field maps nothing
};

/// Draws a deformed solid anew on the slices of an output grid, through the inverse of the field: a place of the output
/// is as deep in the solid as the place that it comes from, and the border is where that depth is zero.
///
/// The inverse is taken at the voxel centres and is bilinear between them; solids that are few voxels wide are looked
/// at more finely, up to four samples a voxel. Corners within 0.01 voxel of the line between others are left out.
class Reslicer {
 public:
  /// @param source  grid of the images that the contours were drawn on
  /// @throws InputError as ContourStack
  Reslicer(std::span<const Contour> contours, const Geometry& source, const Geometry& output);

  /// Draws the solid on a slice; may be called from any thread.
  /// @param inverse_mm  `Maps::inverse_mm`, which buffers slice k of the output
  /// @param k           the slice
  /// @return one result for each kind of Between, in their order
  std::array<SlicedContours, 2> slice(const ConstVolumeView& inverse_mm, std::int64_t k) const;

  const ContourStack& solid() const { return solid_; }

 private:
  struct SliceExtent;
  struct Samples;
  SliceExtent extent_of(const ConstVolumeView& inverse_mm, std::int64_t k) const;
  Samples sample(const ConstVolumeView& inverse_mm, std::int64_t k, const SliceExtent& extent) const;
  std::vector<double> depths(const Samples& samples, Between between) const;
  SlicedContours draw(const Samples& samples, const SliceExtent& extent, std::int64_t k, Between between) const;

  ContourStack solid_;
  Geometry output_;
  AffineMap point_from_output_;
  glm::dvec3 low_, high_;      ///< LPS mm: nothing of the solid, nor near it, is outside this box
  std::int64_t fineness_ = 1;  ///< samples a voxel
};

}  // namespace tetwarp
