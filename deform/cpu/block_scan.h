// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/barycentric.h"
#include "deform/cpu/vector_field.h"

namespace tetwarp::cpu {

/// What a scan of a block of cells with vector instructions found.
struct BlockScan {
  Box box;                  ///< around the deformed vertices, 2^-12 voxel
  bool at_rest;             ///< whether no vertex is displaced
  std::int32_t most_moved;  ///< largest displacement of a vertex on an axis, 2^-12 voxel
  std::uint64_t inverted;   ///< number of inverted tetrahedra; none is degenerate
  /// Least and most of six times the volume of deformed corner tetrahedra (index 0) and centres (1), in float, positive
  /// unless inverted.
  float least[2], most[2];
};

/// Six times the volume of an undeformed corner tetrahedron (kind 0) or centre (1), in float, as `cell_jacobians` has
/// it.
inline float rest_volume(const StepLattice& lattice, int kind) {
  const glm::vec3 x(lattice.cell.x, 0, 0), y(0, lattice.cell.y, 0), z(0, 0, lattice.cell.z);
  return kind == 0 ? detail::edge_determinant(x, y, z) : detail::edge_determinant(y + z, x + z, x + y);
}

/// What a scan of a block finds whose vertices are not displaced.
inline BlockScan block_at_rest(const StepLattice& lattice, const glm::ivec3& first_cell, const glm::ivec3& cells) {
  const glm::i32vec3 cell(lattice.cell), low = glm::i32vec3(lattice.first) + first_cell * cell;
  const float corner = rest_volume(lattice, 0), centre = rest_volume(lattice, 1);
  return {{low, low + cells * cell}, true, 0, 0, {corner, centre}, {corner, centre}};
}

/// Largest block along i, j and k.
constexpr glm::ivec3 kMostScanned(16, 8, 8);

/// Snaps the vertices of a block and computes the volumes of its tetrahedra, with the widest vectors that the processor
/// has (Highway). The volumes are the floats of `edge_determinant`.
///
/// @param cells  size of the block, up to kMostScanned
/// @param scan   the result
/// @return false where float does not prove a sign or a place, or a vertex is far away or not finite
bool scan_block(const VectorField& field, const glm::ivec3& first_cell, const glm::ivec3& cells, BlockScan& scan);

}  // namespace tetwarp::cpu
