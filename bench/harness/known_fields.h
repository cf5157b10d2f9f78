// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <string>

#include "deform/fields/point_map.h"
#include "deform/vertex_field.h"

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

/// Where the content of a voxel comes from.
struct Origin {
  glm::dvec3 displacement{0};  ///< undeformed minus deformed place, voxels; NaN where a field that folds has several
  double outside = 0;          ///< voxels by which the field's reach is missed; 0 or less: there is a source
};

/// A field with a vertex on every voxel, on a lattice of spacing 1 at origin 0, and what is known of its inverse
/// without any program that inverts.
struct KnownField {
  VertexField field;
  std::function<Origin(const glm::dvec3& voxel)> origin;
};

/// The field of a name, for a volume of a size:
///
/// | name | inverse |
/// | --- | --- |
/// | wave, twist | as `make_formula`; the same formula with the sign turned |
/// | bubble | as `make_formula`; its radial profile rises, so it is inverted by bisection |
/// | folds | as `make_test_field`; several places come to one, so only whether there is a source is known |
///
/// Evaluated in double and then rounded to float.
/// @throws InputError for another name
KnownField make_known_field(const std::string& name, const glm::i64vec3& size, int threads);

}  // namespace tetwarp::bench
