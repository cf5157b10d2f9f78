// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/vertex_field.h"

namespace tetwarp {

/// The five tetrahedra of every cell of a lattice as a mesh, with the lattice's numbers; of replaced cells, those of
/// the mesh that takes their place instead, after all others. It knows which vertices are the lattice's
/// (`lattice_vertex`), so that with the lattice at its side it gives the same volumes. A mesh alone is returned as it
/// is.
/// @throws InputError unless there is one displacement for each vertex, for a mesh with a vertex number that is too
/// large, for 2^32 vertices and more, for replaced cells that are not rising or not of the lattice, or for a field in
/// device memory
TetrahedralMesh mesh_of(const FieldView& field);
TetrahedralMesh mesh_of(const VertexField& field);

}  // namespace tetwarp
