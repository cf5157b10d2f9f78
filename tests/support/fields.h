// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "deform/vertex_field.h"
#include "tests/support/random.h"

namespace tetwarp::test {

/// A grid with spacing 1 at the origin: mm are voxels, exactly.
Geometry unit_grid(const glm::i64vec3& size);
/// A rotated grid away from the origin, unequal spacings: no map of it is exact.
Geometry oblique_grid(const glm::i64vec3& size);
/// Rotation matrix about an axis (any length), radians.
glm::dmat3 rotation(const glm::dvec3& axis, double angle);

/// A field on `lattice` whose displacements, in voxels of `output`, are `voxels(rest index of output)`.
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

/// Every vertex displaced by the same mm.
VertexField uniform_field(const Geometry& lattice, const glm::vec3& mm);

/// An output grid and a field over it.
struct FieldCase {
  Geometry output;
  VertexField field;
  std::string description;
  /// Injective fields: the undeformed box is mapped onto its image under this map of output index (each inner vertex
  /// moved before, border vertices within their faces), so every voxel inside the image has one owner and others none.
  AffineMap image;
};

/// A random injective field: vertices on grid points, half points or anywhere, planes kept in place or not; then the
/// whole shifted, mirrored, turned, stretched or sheared. Cells of 1 to 16 voxels.
FieldCase random_injective_case(Random& random);

/// A random field without regard for folds: vertices thrown about, planes collapsed, flattened slivers, mirrored
/// halves.
FieldCase random_folding_case(Random& random);

}  // namespace tetwarp::test
