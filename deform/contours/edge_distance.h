// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <glm/geometric.hpp>

namespace tetwarp {

/// Distance of a point from the edge between two corners, of a plane or in space.
/// @param point  the point
/// @param a      corner where the edge begins
/// @param b      corner where it ends; where both are the same place, that is the edge
template <class Vector>
double distance_to_edge(const Vector& point, const Vector& a, const Vector& b) {
  const Vector along = b - a;
  const double length = glm::dot(along, along);
  const double t = length == 0 ? 0.0 : std::clamp(glm::dot(point - a, along) / length, 0.0, 1.0);
  return glm::distance(point, a + t * along);
}

}  // namespace tetwarp
