// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <string>

#include "deform/vertex_field.h"

namespace tetwarp::bench {

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
