// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads models of Abaqus and CalculiX (.inp): nodes and solid elements. They say no displacement, which
// the option `table` or `deformed` gives.
#include "io/meshes/mesh_format.h"

namespace tetwarp {

extern const MeshFormat kMeshFormat_abaqus;

}  // namespace tetwarp
