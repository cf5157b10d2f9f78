// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/render/camera.h"
#include "deform/vertex_field.h"
#include "io/png.h"

namespace tetwarp {

/// Draws the deformed layer of a lattice that goes through its middle and lies most across the view, as lines between
/// its vertices, every so many that they can be told apart.
/// @param field  with a lattice; cells that a mesh has replaced are drawn as they were
void draw_lattice(Picture& picture, const ViewPlane& plane, const VertexField& field);

}  // namespace tetwarp
