#pragma once

#include "deform/vertex_field.h"

namespace tetwarp {

/// The five tetrahedra of every cell of a lattice as a mesh, with the lattice's numbers. Where vertices rest at the
/// same 2^-12 voxel either way, both give the same volumes.
/// @throws InputError unless there is one displacement for each vertex, or for 2^32 vertices and more
TetrahedralMesh mesh_of(const VertexField& lattice);

}  // namespace tetwarp
