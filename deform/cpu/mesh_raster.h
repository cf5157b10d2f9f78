// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/cell_lists.h"
#include "deform/snapped_mesh.h"

namespace tetwarp::cpu {

/// Owners of the voxels of a box.
struct MeshOwners {
  static constexpr std::uint32_t kNobody = UINT32_MAX;

  std::vector<std::uint32_t> owner;  ///< number of the lowest tetrahedron that owns it, or kNobody; i fastest
  std::vector<std::uint16_t> count;  ///< number of owners of each voxel, saturated; empty unless requested
};

/// Rasterises a mesh: its tetrahedra are listed by bins of voxels, and in a bin each owns an interval of every row
/// (deform/core/row_interval.h).
class MeshRaster {
 public:
  /// Makes the lists of tetrahedra.
  /// @param mesh  must outlive this object unchanged
  /// @throws Cancelled
  void build(const SnappedMesh& mesh, const Geometry& output, const Control& control);

  /// Finds the owners in a part of the output of up to 32 voxels on an axis.
  void find(const Region& box, bool wants_count, MeshOwners& owners) const;

 private:
  Region bin(const glm::i64vec3& at) const;
  template <class Visit>
  void for_each_bin(const Tetrahedron& t, Visit&& visit) const;
  void find_in_bin(std::size_t number, const Region& part, const Region& box, bool wants_count,
                   MeshOwners& owners) const;

  const SnappedMesh* mesh_ = nullptr;
  glm::i64vec3 size_{0};  ///< of the output grid
  /// First voxel of the first bin, and number of bins on each axis. The direction of the nudge changes between bins
  /// only.
  glm::i64vec3 origin_{0}, bins_{0};
  CellLists lists_;  ///< tetrahedra of each bin (bins with i fastest), with rising numbers
};

}  // namespace tetwarp::cpu
