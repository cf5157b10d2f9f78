// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <optional>

#include "deform/cell_lists.h"
#include "deform/snapped_mesh.h"

namespace tetwarp {

/// Finds the tetrahedron of an undeformed mesh that holds a point. The tetrahedra are listed by the cells of a grid
/// over the mesh.
class MeshLocator {
 public:
  /// @param mesh  must stay as it is
  explicit MeshLocator(const SnappedMesh& mesh);

  /// A tetrahedron and the weights of its corners A, B, C at a point.
  struct Location {
    std::uint32_t tetrahedron;
    glm::dvec3 weights;
  };
  /// The tetrahedron with the lowest number that holds the point; if there is none, the nearest that is at most 2^-12
  /// voxel away.
  /// @param steps  output index in 2^-12 voxel, not rounded
  std::optional<Location> find(const glm::dvec3& steps) const;

 private:
  std::int64_t cell_on_axis(int axis, double at) const;

  const SnappedMesh& mesh_;
  glm::dvec3 low_{0}, cell_{1};  ///< 2^-12 voxel: least corner of the grid, and size of its cells
  glm::i64vec3 cells_{0};        ///< on each axis
  CellLists lists_;              ///< by cell, i fastest: numbers of the tetrahedra that may reach it, rising
};

}  // namespace tetwarp
