// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <span>
#include <vector>

#include "deform/contours/contour.h"
#include "deform/points.h"

namespace tetwarp {

/// How far a point may be from the plane of a slice that it is drawn on, mm.
constexpr double kOnSlice = 0.01;

/// A contour whose points were moved by the forward map of a field.
struct MovedContour {
  Contour contour;          ///< the kind as it was, but for an open one that has left its plane
  double lowest, highest;   ///< by how much it moved along the normal of the slices, mm
  std::size_t outside = 0;  ///< points that the field does not reach: they stay
  bool rests = true;        ///< none has moved
};

/// Moves contours of a structure as points: exact, but what was in a plane need not stay in one.
class ContourMover {
 public:
  /// @param output  grid of the images that the contours are to be drawn on; mover and grid must outlive this
  ContourMover(const PointMover& mover, const Geometry& output) : mover_(mover), output_(output) {}

  /// Edges are followed: where the middle of one comes to lie more than a tenth of a voxel from the straight line
  /// between its moved ends, corners are added. The contour's slice is the one that all of it lies on.
  MovedContour move(const Contour& contour) const;

  /// All closed contours of a structure, if they are still what they were: all moved by the same distance along the
  /// normal of the slices, and as near to slices of the output as they were to those of the source. Else none.
  /// @param outside  what becomes of points that the field does not reach; unless they rest, they are known only where
  ///                 nothing of the structure moves
  std::optional<std::vector<MovedContour>> move_within_slices(std::span<const Contour> contours, const Geometry& source,
                                                              Outside outside) const;

 private:
  const PointMover& mover_;
  const Geometry& output_;
};

/// The slice of a grid in whose plane all the points lie, within kOnSlice.
std::optional<std::int64_t> slice_of(std::span<const glm::dvec3> points, const Geometry& grid);

}  // namespace tetwarp
