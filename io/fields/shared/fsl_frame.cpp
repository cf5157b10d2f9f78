// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/shared/fsl_frame.h"

#include <glm/matrix.hpp>

namespace tetwarp {
namespace {

/// The map from FSL's coordinates to continuous index.
AffineMap index_from_fsl(const Geometry& image) {
  AffineMap map;
  for (int axis = 0; axis < 3; ++axis) map.linear[axis][axis] = 1 / image.spacing[axis];
  if (glm::determinant(image.direction) > 0) {
    map.linear[0][0] *= -1;
    map.offset.x = static_cast<double>(image.size.x - 1);
  }
  return map;
}

}  // namespace

AffineMap lps_from_fsl(const Geometry& image) { return point_from_index(image) * index_from_fsl(image); }

AffineMap fsl_from_lps(const Geometry& image) { return inverse_of(index_from_fsl(image)) * index_from_point(image); }

}  // namespace tetwarp
