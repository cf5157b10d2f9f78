// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <glm/common.hpp>

#include "deform/core/five_tetrahedra.h"

namespace tetwarp {

/// The undeformed tetrahedron of a cell that holds a place, and the weights of its corners A, B, C there. The weight of
/// D is 1 - a - b - c.
struct CellWeights {
  TetrahedronCorners corners;
  double a, b, c;
};

/// Finds the tetrahedron of an undeformed cell that holds a place.
/// @param at   place in the cell, 0 to 1 on each axis
/// @param odd  parity of the cell
inline CellWeights weights_in_cell(const glm::dvec3& at, bool odd) {
  for (int t = 1; t < kTetrahedraPerCell; ++t) {
    const TetrahedronCorners corners = tetrahedron_corners(t, odd);
    const glm::dvec3 from = glm::abs(at - glm::dvec3(corners.d & 1, corners.d >> 1 & 1, corners.d >> 2));
    if (from.x + from.y + from.z <= 1) return {corners, from.x, from.y, from.z};
  }
  const TetrahedronCorners corners = tetrahedron_corners(0, odd);
  const glm::dvec3 from = glm::abs(at - glm::dvec3(corners.d & 1, corners.d >> 1 & 1, corners.d >> 2));
  return {corners, 0.5 * (from.y + from.z - from.x), 0.5 * (from.x + from.z - from.y),
          0.5 * (from.x + from.y - from.z)};
}

}  // namespace tetwarp
