// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/cpu/lattice_index.h"

namespace tetwarp::cpu {

/// Finds owners by scatter: every cell that may reach a box of voxels claims the voxels that its tetrahedra own, and
/// the lowest number wins, whatever the order. It is right for every field, and slow.
struct Claims {
  static constexpr std::uint64_t kNobody = UINT64_MAX;

  // Each vector has one entry for each voxel of the box, i fastest.
  std::vector<std::uint64_t> owner;   ///< number of the lowest tetrahedron that owns it, or kNobody
  std::vector<glm::vec3> offset;      ///< undeformed minus deformed place, voxels, of voxels with an owner
  std::vector<float> jacobian;        ///< Jacobian determinant of the owner; empty unless requested
  std::vector<std::uint16_t> owners;  ///< number of owners, saturated; empty unless requested

  /// @param block  scratch
  void find(const LatticeIndex& lattice, const Region& box, bool wants_jacobian, bool wants_owners,
            LatticeBlock& block);
};

}  // namespace tetwarp::cpu
