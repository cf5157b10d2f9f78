// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads unstructured grids of VTK, XML (.vtu) and legacy (.vtk), whose displacement is point data.
#include "io/meshes/mesh_format.h"

namespace tetwarp {

/// Solid cells are read: linear ones, and those of higher order by their corners. Points, lines and surfaces are left
/// out with a note. Polyhedra and other cells without a fixed shape are refused.
extern const MeshFormat kMeshFormat_vtk;

}  // namespace tetwarp
