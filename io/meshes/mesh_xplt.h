// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads plot files of FEBio (.xplt): a mesh, and at each state the displacement of its nodes.
#include "io/meshes/mesh_format.h"

namespace tetwarp {

extern const MeshFormat kMeshFormat_xplt;

}  // namespace tetwarp
