// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include "deform/volume.h"

namespace tetwarp {

/// Which way a field maps. In the code the two are types of their own; this names one of them where a file or an option
/// decides.
enum class Direction : std::uint8_t {
  forward,  ///< undeformed to deformed points (VertexField)
  pull      ///< output to input points (PullField)
};

/// Tetrahedra of any size, as finite element programs write them. Inside each the map is affine.
struct TetrahedralMesh {
  std::vector<glm::dvec3> rest;          ///< undeformed place of each vertex, LPS mm
  std::vector<glm::vec3> displacement;   ///< LPS mm, deformed minus rest, one a vertex; zero rests exactly
  std::vector<glm::u32vec4> tetrahedra;  ///< four vertex numbers each, in either orientation
  /// For a mesh that was made from a lattice or takes the place of some of its cells: the number of the lattice vertex
  /// (i fastest) that each vertex coincides with undeformed, or -1. Such vertices are rounded exactly as those of the
  /// lattice, if the lattice is given with the mesh (`VertexField::lattice`). Empty where there is no lattice, or where
  /// the places alone decide.
  std::vector<std::int64_t> lattice_vertex = {};

  /// Whether there is no tetrahedron.
  bool is_empty() const { return tetrahedra.empty(); }
};

/// Forward deformation: where each vertex of a regular lattice goes. A mesh may take the place of the lattice, or of
/// some of its cells (cuts). It is a plain value; simulators, files and formulas return it.
///
/// Every cell of the lattice is split into five tetrahedra (deform/core/five_tetrahedra.h). Inside each the map is
/// affine.
struct VertexField {
  /// Grid of the undeformed vertices; its last cells may extend beyond a volume. Its size is 0 for a mesh without a
  /// lattice.
  Geometry lattice;
  /// Deformed minus undeformed place of each vertex, LPS mm, i fastest. 12 bytes each: 1.9 GB for 512 x 512 x 600.
  /// Vertices of zero displacement do not move at all.
  std::vector<glm::vec3> displacement;
  /// Stands in the place of the lattice, or of the cells in `replaced`.
  TetrahedralMesh mesh = {};
  /// Numbers of the cells (i fastest, rising) whose place the mesh takes. Numbers of the mesh's tetrahedra follow those
  /// of the lattice.
  std::vector<std::uint64_t> replaced = {};
};

/// Deformation in the other direction, as registration tools write it: what lies at output point p comes from p + d(p).
/// It is a type of its own, because the two directions never convert silently.
struct PullField {
  Geometry grid;  ///< grid of the samples of d; between them d is trilinear
  /// Input point minus output point at each sample, LPS mm, i fastest. NaN says that there is no input point, as in
  /// `Maps::inverse_mm`.
  std::vector<glm::vec3> displacement;
};

/// What becomes of a voxel that lies outside the undeformed lattice or mesh (or the grid of a pull field) and that no
/// tetrahedron owns.
enum class Outside : std::uint8_t {
  refuse,     ///< the field must reach over the whole output; otherwise `set_field` of the resampler throws
  rest,       ///< the voxel stays where it is
  background  ///< the voxel gets the background, and coverage 0
};

/// A forward field that something else owns. The field must outlive the view, and the Resampler that took it.
struct FieldView {
  /// Grid of the undeformed vertices. For a mesh that stands alone: the lattice to which
  /// `TetrahedralMesh::lattice_vertex` refers, or null.
  const Geometry* lattice = nullptr;
  /// Of each lattice vertex, LPS mm, i fastest; null for a mesh that stands alone.
  const glm::vec3* displacement = nullptr;
  Outside outside = Outside::refuse;  ///< what becomes of voxels outside the undeformed lattice or mesh
  Memory memory = Memory::host;       ///< where `displacement` lies; the lattice lies in host memory
  /// In the place of the lattice, or of the cells in `replaced`; in host memory.
  const TetrahedralMesh* mesh = nullptr;
  /// Numbers of the cells whose place the mesh takes; empty: the mesh, if any, stands alone.
  std::span<const std::uint64_t> replaced = {};
};
/// A pull field that something else owns. The field must outlive the view, and the Resampler that took it.
struct PullFieldView {
  const Geometry* grid = nullptr;           ///< grid of the samples
  const glm::vec3* displacement = nullptr;  ///< of each sample, LPS mm, i fastest
  Outside outside = Outside::refuse;        ///< what becomes of voxels outside the grid
  Memory memory = Memory::host;             ///< where `displacement` lies; the grid lies in host memory
};

/// A view of a forward field in host memory.
/// @throws InputError unless there is one displacement for each vertex of the lattice and of the mesh
FieldView view(const VertexField& field, Outside outside = Outside::refuse);
/// A view of a pull field in host memory.
/// @throws InputError unless there is one displacement for each sample
PullFieldView view(const PullField& field, Outside outside = Outside::refuse);
/// The samples as a volume of type f32 with 3 components, as `Maps::inverse_mm` wants it.
/// @throws InputError unless there is one displacement for each sample
VolumeView samples_of(PullField& field);

}  // namespace tetwarp
