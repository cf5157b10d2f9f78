// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "deform/vertex_field.h"

namespace tetwarp {

/// Whether the mesh of a field says which vertices of the field's lattice its own are
/// (`TetrahedralMesh::lattice_vertex`).
bool has_lattice_vertices(const VertexField& field);

/// The five tetrahedra of every cell of a lattice, as a mesh with the same numbers. Replaced cells are left out, and
/// tetrahedra that replace them follow after all others. A mesh that stands alone is returned as it is.
/// The mesh states which vertices are those of the lattice (`TetrahedralMesh::lattice_vertex`), so together with the
/// lattice it gives the same deformed volumes.
/// @throws InputError unless there is one displacement for each vertex; for a mesh with a vertex number that is too
///         large; for 2^32 or more vertices; for replaced cells that do not rise or are not of the lattice; or for a
///         field in device memory
TetrahedralMesh mesh_of(const FieldView& field);
/// The tetrahedra of a field as a mesh: `mesh_of` of its view.
TetrahedralMesh mesh_of(const VertexField& field);
/// The mesh that a lattice with replaced cells is made into, as `mesh_of` makes it; none of any other field, whose
/// mesh, if it has one, serves as it is.
std::optional<TetrahedralMesh> mesh_of_cut(const FieldView& field);

}  // namespace tetwarp
