// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "deform/vertex_field.h"
#include "tests/support/random.h"

namespace tetwarp::test {

/// A grid with spacing 1 mm at the origin, so that mm are voxels exactly.
Geometry unit_grid(const glm::i64vec3& size);
/// A rotated grid away from the origin, with unequal spacings, so that none of its maps is exact.
Geometry oblique_grid(const glm::i64vec3& size);
/// A rotation matrix. @param axis  of any length  @param angle  radians
glm::dmat3 rotation(const glm::dvec3& axis, double angle);

/// A field on `lattice`. @param voxels  gives the displacement, in voxels of `output`, of an undeformed place in output
/// index
template <class Function>
VertexField field_in_voxels(const Geometry& output, const Geometry& lattice, Function&& voxels) {
  const AffineMap index = index_from_point(output) * point_from_index(lattice);
  const glm::dmat3 mm = point_from_index(output).linear;
  VertexField field{lattice, {}};
  field.displacement.reserve(static_cast<std::size_t>(voxel_count(lattice)));
  for (std::int64_t k = 0; k < lattice.size.z; ++k) {
    for (std::int64_t j = 0; j < lattice.size.y; ++j) {
      for (std::int64_t i = 0; i < lattice.size.x; ++i) {
        const glm::dvec3 moved = voxels(index(glm::dvec3(i, j, k)));
        field.displacement.push_back(glm::vec3(mm * moved));
      }
    }
  }
  return field;
}

/// A field that displaces every vertex by the same vector in mm.
VertexField uniform_field(const Geometry& lattice, const glm::vec3& mm);

/// An output grid and a field over it.
struct FieldCase {
  Geometry output;
  VertexField field;
  std::string description;
  /// For injective fields: a map of output index that takes the undeformed box onto the deformed one. (Each inner
  /// vertex was moved before, border vertices within their faces.) Every voxel inside the image has one owner, and
  /// others have none.
  AffineMap image;
};

/// A random injective field. Vertices lie on grid points, on half points or anywhere, and planes are kept in place or
/// not; then the whole is shifted, mirrored, turned, stretched or sheared. Cells have 1 to 16 voxels.
FieldCase random_injective_case(Random& random);

/// A random field without regard for folds: vertices thrown about, planes collapsed, flattened slivers, mirrored
/// halves.
FieldCase random_folding_case(Random& random);

}  // namespace tetwarp::test
