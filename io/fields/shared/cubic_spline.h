// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. The B-spline of transforms that Tetwarp evaluates itself.
#include <cstdint>
#include <vector>

#include "deform/geometry.h"

namespace tetwarp {

/// A uniform B-spline of order 3 of vectors, in double.
struct CubicSpline {
  /// What stands beyond the outermost control points: they go on, or nothing.
  enum class Beyond : std::uint8_t { outermost, zero };

  glm::i64vec3 size{0};             ///< number of control points along each axis
  std::vector<glm::dvec3> control;  ///< one vector a control point, i fastest
  Beyond beyond = Beyond::outermost;

  /// The vector at an index, at which control point (n, n, n) has its largest weight where that is (n, n, n).
  glm::dvec3 at(const glm::dvec3& index) const;
};

}  // namespace tetwarp
