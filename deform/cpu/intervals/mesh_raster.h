// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/cell_lists.h"
#include "deform/cpu/intervals/interval_tile.h"
#include "deform/snapped_mesh.h"

namespace tetwarp::cpu {

/// Finds who owns voxels of a mesh. Its tetrahedra are listed by bins of voxels.
class MeshRaster {
 public:
  /// Makes the lists of tetrahedra.
  /// @param mesh  must outlive this object unchanged
  /// @throws Cancelled
  void build(const SnappedMesh& mesh, const Geometry& output, const Control& control);

  /// Finds the owners in a part of the output of up to kTile voxels on an axis.
  /// @param counts  whether voxels are to be counted out among several owners
  /// @param sink    gets what tetrahedra own, unless null
  void find(const Region& box, bool counts, IntervalTile& tile, IntervalSink* sink) const;

 private:
  Region bin(const glm::i64vec3& at) const;
  std::size_t bin_number(const glm::i64vec3& at) const {
    return static_cast<std::size_t>((at.z * bins_.y + at.y) * bins_.x + at.x);
  }
  template <class Visit>
  void for_each_bin(const Tetrahedron& t, Visit&& visit) const;

  const SnappedMesh* mesh_ = nullptr;
  glm::i64vec3 size_{0};  ///< of the output grid
  glm::i64vec3 bins_{0};  ///< on each axis
  CellLists lists_;       ///< tetrahedra of each bin (bins with i fastest), with rising numbers
};

}  // namespace tetwarp::cpu
