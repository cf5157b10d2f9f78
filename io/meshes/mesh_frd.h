// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads results of CalculiX in text (.frd): nodes, solid elements, and displacements by step.
#include "io/meshes/mesh_format.h"

namespace tetwarp {

extern const MeshFormat kMeshFormat_frd;

}  // namespace tetwarp
