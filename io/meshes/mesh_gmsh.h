// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "io/meshes/mesh_format.h"

namespace tetwarp {

/// Gmsh's MSH 4.0, 4.1 and 2.x, text or binary of either byte order (Gmsh reference manual, "MSH file format" and its
/// legacy formats). Vectors are the $NodeData of three components. $Periodic and all other sections are left out.
extern const MeshFormat kMeshFormat_gmsh;

}  // namespace tetwarp
