// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/vertex_field.h"

namespace tetwarp {

/// The forward field that does the work of a pull field in reverse: its vertices are the samples of the pull field, and
/// each goes to where the pull field takes its voxel from.
///
/// The lattice grows by whole cells until its image holds the grid `target`; the vertices added have the displacement
/// of the nearest sample. So the inverse of the result, on `target`, has a value everywhere. It is enough to look at
/// the faces of the grown lattice (theorem of Poincare and Miranda), whatever lies between them.
/// @throws InputError for a sample that is not finite, or where the lattice would grow to more than 8 times the samples
///         of both grids, because they lie far apart
VertexField continued_over(const PullField& field, const Geometry& target);

}  // namespace tetwarp
