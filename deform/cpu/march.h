// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "deform/core/gather.h"
#include "deform/cpu/tiles.h"
#include "deform/cpu/vector_field.h"

namespace tetwarp::cpu {

/// How many tetrahedra own a voxel, as far as it is known before any is looked at.
enum class Owners : std::uint8_t {
  none = 0,
  one = 1,
  several = 2  ///< or none, or one: to be claimed
};

/// A voxel whose owner was not found, and where it may come from.
struct Unsettled {
  int voxel;        ///< within its tile: i + kTile (j + kTile k)
  glm::vec3 place;  ///< cells; may be no numbers
};

/// What a march needs beside its tile; kept from tile to tile.
struct MarchScratch {
  static constexpr int kRows = static_cast<int>(kTile), kRoom = 16;  ///< lanes of the widest vectors
  static constexpr std::size_t kSlice = static_cast<std::size_t>(kTile * kTile);

  /// Where the next voxel of each column is expected to come from, cells.
  float x[kSlice + kRoom], y[kSlice + kRoom], z[kSlice + kRoom];
  /// What could not be settled at once, of one slice.
  struct Queue {
    float x[kSlice + kRoom], y[kSlice + kRoom], z[kSlice + kRoom];
    std::int32_t voxel[kSlice + kRoom];
    int count = 0;
  } queue;
  std::vector<Unsettled> unsettled;  ///< of the whole tile
};

/// A box of voxels, up to kTile on each axis. Whole vectors are read and written: both arrays have
/// `MarchScratch::kRoom` elements more than the box has voxels.
struct MarchTile {
  IntBox box;
  const Owners* owners;  ///< of each voxel, i fastest
  glm::vec3* offset;     ///< likewise, written: undeformed minus deformed place, voxels
};

/// Finds the owners of the voxels of a tile that have one, by the widest vectors that the processor has (Highway).
///
/// As the march of cuda/owners/march.cuh: along k, each owner predicted from the affine map of the one before, and
/// accepted where float arithmetic proves it (`try_tetrahedron`) or, at a second look, double. Offsets are made by the
/// operations of `interpolate_u`, so they have its bits. What is not found so comes out in `scratch.unsettled`; other
/// offsets are left as anything.
void march(const VectorField& field, const NudgeTurns& nudge, const MarchTile& tile, MarchScratch& scratch);

}  // namespace tetwarp::cpu
