// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/barycentric.h"
#include "deform/cpu/vector_field.h"

namespace tetwarp::cpu {

/// What vectors find out about a block of cells.
struct BlockScan {
  Box box;                  ///< of the deformed vertices, 2^-12 voxel
  bool at_rest;             ///< no vertex moved
  std::int32_t most_moved;  ///< steps that a vertex is displaced on an axis
  std::uint64_t inverted;   ///< tetrahedra; none is degenerate
  /// Least and most of six times the volumes, positive where upright, of corner tetrahedra and of centres, in float.
  float least[2], most[2];
};

/// Six times the volume at rest of a corner tetrahedron (kind 0) or a centre (1), in float as `cell_jacobians` has it.
inline float rest_volume(const StepLattice& lattice, int kind) {
  const glm::vec3 x(lattice.cell.x, 0, 0), y(0, lattice.cell.y, 0), z(0, 0, lattice.cell.z);
  return kind == 0 ? detail::edge_determinant(x, y, z) : detail::edge_determinant(y + z, x + z, x + y);
}

/// What it is of a block at rest.
inline BlockScan block_at_rest(const StepLattice& lattice, const glm::ivec3& first_cell, const glm::ivec3& cells) {
  const glm::i32vec3 cell(lattice.cell), low = glm::i32vec3(lattice.first) + first_cell * cell;
  const float corner = rest_volume(lattice, 0), centre = rest_volume(lattice, 1);
  return {{low, low + cells * cell}, true, 0, 0, {corner, centre}, {corner, centre}};
}

/// Largest block along i, j and k.
constexpr glm::ivec3 kMostScanned(16, 8, 8);

/// Snaps the vertices of a block and takes the volumes of its tetrahedra, by the widest vectors that the processor has
/// (Highway): the floats of `edge_determinant`.
///
/// @param cells  up to kMostScanned  @param scan  written
/// @return false where float is not certain of a sign or a place, or a vertex is far away or not finite
bool scan_block(const VectorField& field, const glm::ivec3& first_cell, const glm::ivec3& cells, BlockScan& scan);

}  // namespace tetwarp::cpu
