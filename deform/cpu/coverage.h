// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "deform/cpu/lattice_index.h"
#include "deform/cpu/march.h"

namespace tetwarp::cpu {

/// How many tetrahedra own each voxel: the winding number of the deformed border (docs/design, "Gather"). It is
/// stored as the places where rows of voxels pass through the border, and, tile by tile, what inverted tetrahedra may
/// reach.
class Coverage {
 public:
  /// Looks at the whole border, in parallel in the calling task arena.
  /// @param index  must have `steps`, and must outlive this object unchanged
  void find(const LatticeIndex& index, const Geometry& output);

  /// Writes how many owners each voxel of a box has.
  /// @param owners  one for each voxel of the box, i fastest
  /// @param block   scratch memory
  /// @return number of voxels that are Owners::several
  std::int64_t owners_of(const Region& box, Owners* owners, LatticeBlock& block) const;

 private:
  /// From this voxel of its row on, the winding number is larger by `change`.
  struct Crossing {
    std::int32_t voxel, change;
  };
  struct CrossingInRow {
    std::int64_t row;
    Crossing crossing;
  };

  void look_at_row(int axis, bool high, int last, std::vector<CrossingInRow>& found) const;
  void sort_into_rows(const std::vector<const std::vector<CrossingInRow>*>& found);
  std::int64_t add_inverted(const Region& box, Owners* owners, LatticeBlock& block) const;

  const LatticeIndex* index_ = nullptr;
  glm::i64vec3 size_{0};
  std::vector<std::int64_t> first_;  ///< first crossing of each row, and one after the last crossing
  std::vector<Crossing> crossings_;  ///< row by row, ordered by voxel
};

}  // namespace tetwarp::cpu
