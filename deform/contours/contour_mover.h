// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <span>
#include <vector>

#include "deform/contours/contour.h"
#include "deform/points.h"

namespace tetwarp {

/// Largest distance, mm, of a point from the plane of the slice on which it counts as drawn.
constexpr double kOnSlice = 0.01;

/// A contour whose points were moved by the forward map of a field.
struct MovedContour {
  Contour contour;  ///< of the same kind as before, except for an open contour that has left its plane
  /// Smallest and largest motion of a point along the normal of the slices, mm.
  double lowest, highest;
  std::size_t outside = 0;  ///< number of points outside the field, which stay
  bool rests = true;        ///< whether no point has moved
};

/// Moves contours of a structure point by point. That is exact, but points that lay in one plane need not stay in one.
class ContourMover {
 public:
  /// @param output  grid of the images that the contours are to be drawn on; mover and grid must outlive this
  ContourMover(const PointMover& mover, const Geometry& output) : mover_(mover), output_(output) {}

  /// Moves a contour. Where the middle of an edge comes to lie more than a tenth of a voxel from the straight line
  /// between the moved ends, corners are added. `Contour::slice` is set if the whole contour lies on one slice.
  MovedContour move(const Contour& contour) const;

  /// All closed contours of a structure, if moving left them what they were: all moved by the same distance along the
  /// normal of the slices, and as near to slices of the output as they were to those of the source. Otherwise nothing.
  /// @param outside  what becomes of points outside the field; unless they rest, the result is known only where nothing
  ///         of the structure moves
  std::optional<std::vector<MovedContour>> move_within_slices(std::span<const Contour> contours, const Geometry& source,
                                                              Outside outside) const;

 private:
  const PointMover& mover_;
  const Geometry& output_;
};

/// The slice of a grid in whose plane all the points lie, to within kOnSlice.
std::optional<std::int64_t> slice_of(std::span<const glm::dvec3> points, const Geometry& grid);

}  // namespace tetwarp
