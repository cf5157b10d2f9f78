// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include "deform/volume.h"

namespace tetwarp {

/// Explicit tetrahedra of any size, as finite element programs write them; inside each the map is affine.
struct TetrahedralMesh {
  std::vector<glm::dvec3> rest;          ///< LPS mm of each vertex
  std::vector<glm::vec3> displacement;   ///< LPS mm, deformed minus rest, one a vertex; zero rests exactly
  std::vector<glm::u32vec4> tetrahedra;  ///< vertex numbers; in either orientation
  /// Of a mesh that takes the place of cells of a lattice, or that a lattice was made into: the number of the lattice's
  /// vertex (i fastest) that each vertex rests at, -1 for none. Such vertices are snapped as the lattice's own are,
  /// where the lattice is beside the mesh (`VertexField::lattice`). Empty: places tell, or there is no lattice.
  std::vector<std::int64_t> lattice_vertex = {};

  bool is_empty() const { return tetrahedra.empty(); }
};

/// Forward deformation: a regular lattice of vertices and where each goes, a mesh, or a lattice of which a mesh takes
/// the place of some cells (cuts). A value; simulators, files and formulas return it.
///
/// Every cell of the lattice is split into five tetrahedra (core/five_tetrahedra.h); inside each the map is affine.
struct VertexField {
  Geometry lattice;                     ///< of the undeformed vertices; its last cells may overhang a volume. Size 0:
                                        ///< there is a mesh, of no lattice
  std::vector<glm::vec3> displacement;  ///< LPS mm, deformed minus rest, i fastest, 12 bytes each (1.9 GB at
                                        ///< 512x512x600); zero rests exactly
  TetrahedralMesh mesh = {};            ///< in the place of a lattice, or of some of its cells
  std::vector<std::uint64_t> replaced = {};  ///< these cells, i fastest, rising; the mesh's tetrahedra follow the
                                             ///< lattice's
};

/// Deformation the other way round, as registration tools write it: what lies at output point p comes from p + d(p).
/// Another type, for the two never convert silently.
struct PullField {
  Geometry grid;                        ///< samples of d; trilinear between them
  std::vector<glm::vec3> displacement;  ///< LPS mm, input point minus output point, i fastest; NaN: there is no input
                                        ///< point, as Maps::inverse_mm says it
};

/// What becomes of a voxel that lies outside the undeformed lattice or mesh (or the grid of a pull field), where no
/// tetrahedron owns it.
enum class Outside : std::uint8_t {
  refuse,     ///< the field must reach over the whole output: `set_field` throws otherwise
  rest,       ///< the voxel stays where it is
  background  ///< the voxel gets the background, its coverage is 0
};

/// Not an owner: the field must outlive the view, and the Resampler that the view was given to.
struct FieldView {
  const Geometry* lattice = nullptr;  ///< of a mesh that stands alone: the one that `lattice_vertex` counts in, or null
  const glm::vec3* displacement = nullptr;
  Outside outside = Outside::refuse;
  Memory memory = Memory::host;                  ///< of `displacement`; the lattice is always the host's
  const TetrahedralMesh* mesh = nullptr;         ///< in the place of lattice and displacement; in host memory
  std::span<const std::uint64_t> replaced = {};  ///< not empty: the mesh takes the place of these cells alone
};
struct PullFieldView {
  const Geometry* grid = nullptr;
  const glm::vec3* displacement = nullptr;
  Outside outside = Outside::refuse;
  Memory memory = Memory::host;
};

/// @throws InputError unless there is one displacement for each vertex, of a lattice or of a mesh
FieldView view(const VertexField& field, Outside outside = Outside::refuse);
PullFieldView view(const PullField& field, Outside outside = Outside::refuse);
/// The samples as a volume of three floats: for `Maps::inverse_mm`. @throws InputError as `view`
VolumeView samples_of(PullField& field);

}  // namespace tetwarp
