// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

#include "deform/vertex_field.h"

namespace tetwarp {

/// Whether `write_mesh_file` writes files of this name: .vtu .vtk.
bool has_mesh_suffix(const std::filesystem::path& path);

/// Writes a mesh as VTK's unstructured grid: XML with raw appended data (.vtu) or legacy binary of version 3 (.vtk),
/// without VTK. Points are the rest positions (LPS mm, double), the point vectors `displacement` lead to the deformed
/// ones (float). Corners of tetrahedra keep their order, in either orientation, so that what is read again is the same.
/// @throws InputError for another suffix, more than 2^31 vertices or arrays that do not fit together; Error where it
/// cannot be written (disk full)
///
/// @param lattice  where the mesh has `lattice_vertex`, the one that it counts in: it is written too
/// (io/meshes/mesh_lattice.h), so that the vertices are snapped as the lattice's own when the file is read again
void write_mesh_file(const std::filesystem::path& path, const TetrahedralMesh& mesh, const Geometry& lattice = {});

}  // namespace tetwarp
