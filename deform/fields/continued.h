// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/vertex_field.h"

namespace tetwarp {

/// A pull field as a forward one: its samples are the vertices of a lattice, and each goes where the field takes its
/// voxel from. The lattice is grown by whole cells until its image holds `target`: there the displacement is that of
/// the nearest sample.
///
/// So the inverse on `target` is the forward field that does what the pull field does, and has a value everywhere.
/// That the image holds `target` follows from the faces of the grown lattice alone (theorem of Poincare and Miranda),
/// whatever lies between them.
/// @throws InputError for a sample that is not finite, or where the lattice would grow to more than 8 times the samples
///         of both grids: they lie far apart
VertexField continued_over(const PullField& field, const Geometry& target);

}  // namespace tetwarp
