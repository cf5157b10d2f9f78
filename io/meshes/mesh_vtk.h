// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Unstructured grids of VTK, XML (.vtu) and legacy (.vtk), whose displacement is point data.
#include "io/meshes/mesh_format.h"

namespace tetwarp {

/// Solid cells are taken, linear ones and by their corners those of higher order; points, lines and surfaces are left
/// out with a note. A polyhedron and what else has no fixed shape is refused.
extern const MeshFormat kMeshFormat_vtk;

}  // namespace tetwarp
