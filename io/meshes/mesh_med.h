// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads MED files of Salome and Code_Aster (.med .rmed .mmed): a mesh, and fields of vectors at its
// nodes by name and step.
#include "io/meshes/mesh_format.h"

namespace tetwarp {

extern const MeshFormat kMeshFormat_med;

}  // namespace tetwarp
