// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <string>

#include "deform/fields/point_map.h"

namespace tetwarp::bench {

/// A deformation without folds, in double, and its derivative: no program that inverts or differentiates is asked.
/// Points are voxels of a volume with spacing 1 and origin 0.
struct SmoothField {
  PointMap displacement;                                    ///< deformed minus undeformed
  std::function<glm::dmat3(const glm::dvec3&)> derivative;  ///< column c: of the displacement along axis c
};

/// The field of a name: `bubble` as `make_formula`, `elastic` as `make_test_field`. @throws InputError for another name
SmoothField make_smooth_field(const std::string& name, const glm::i64vec3& size);

/// How much the deformation enlarges what rests at a point.
double determinant(const SmoothField& field, const glm::dvec3& rest);

/// The inverse on a grid, undeformed minus deformed point, rounded to float at last: Newton's method in double, each
/// begun where its neighbour along i ended, until the point found goes to within 1e-10 voxel of the voxel.
/// @throws Error where that does not happen
PullField invert_closely(const SmoothField& field, const Geometry& grid, int threads);

}  // namespace tetwarp::bench
