// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

#include "deform/vertex_field.h"

namespace tetwarp {

/// Whether `write_mesh_file` writes files of this name: .vtu or .vtk.
bool has_mesh_suffix(const std::filesystem::path& path);

/// Writes a mesh as an unstructured grid of VTK: XML with raw appended data (.vtu) or legacy binary of version 3
/// (.vtk), without using VTK. Points are undeformed (LPS mm, double); the point vectors `displacement` lead to the
/// deformed places (float). Corners of tetrahedra keep their order, so that the same mesh is read again.
///
/// @param path     file to write
/// @param mesh     the mesh
/// @param lattice  if the mesh has `TetrahedralMesh::lattice_vertex`, the lattice to which that refers. It is written
///         too, so that vertices are rounded as those of the lattice when the file is read again.
/// @throws InputError for another suffix, more than 2^31 vertices, or arrays that do not fit each other
/// @throws Error where the file cannot be written
void write_mesh_file(const std::filesystem::path& path, const TetrahedralMesh& mesh, const Geometry& lattice = {});

}  // namespace tetwarp
