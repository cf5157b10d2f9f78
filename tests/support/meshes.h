// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/vertex_field.h"
#include "tests/support/random.h"

namespace tetwarp::test {

/// A mesh that fills the box between two corners of output index, with vertices where nobody would put them: planes lie
/// at random distances (some edges are shorter than a voxel, some much longer), inner vertices are moved at random,
/// tetrahedra have any order and orientation. Undeformed it has no gap and no overlap.
/// @param most_cells  on an axis
TetrahedralMesh random_mesh(const Geometry& output, const glm::dvec3& low, const glm::dvec3& high, int most_cells,
                            Random& random);

/// Moves each vertex by up to `voxels`, and those on the border of the undeformed box by up to `on_border`.
void shake(TetrahedralMesh& mesh, const Geometry& output, double voxels, double on_border, Random& random);

/// Tetrahedra that share no vertices, of all sizes and some without volume; they overlap.
TetrahedralMesh loose_tetrahedra(const Geometry& output, int count, double size, Random& random);

/// A forward field that is a mesh alone.
VertexField field_of(TetrahedralMesh mesh);

}  // namespace tetwarp::test
