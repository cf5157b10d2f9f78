// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/vertex_field.h"

namespace tetwarp::viewer {

/// Takes the displacements of a lattice at the points of another one, trilinear between its vertices. For a picture of
/// a few voxels a vertex at each of them costs less than the large tetrahedra of the lattice, of which each would be
/// prepared for a handful of voxels. Inside cells the map is another one than that of the tetrahedra.
/// @param field    in host memory
/// @param samples  its lattice says where to take them, and its displacements are set
/// @return  false, and nothing is set, for a mesh, or where the axes of the lattices differ, or a point lies more than
///          half a step outside of the field; nearer ones, such as the last blocks of a volume have, get the nearest
///          displacement
bool sample_field(const FieldView& field, VertexField& samples);

}  // namespace tetwarp::viewer
