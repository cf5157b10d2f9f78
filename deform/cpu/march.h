// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "deform/core/gather.h"
#include "deform/cpu/tiles.h"
#include "deform/cpu/vector_field.h"

namespace tetwarp::cpu {

/// How many tetrahedra own a voxel, as far as this is known before any tetrahedron is tested.
enum class Owners : std::uint8_t {
  none = 0,
  one = 1,
  several = 2  ///< unknown: none, one or more; the voxel is to be claimed
};

/// A voxel whose owner the march did not find, and where the voxel may come from.
struct Unsettled {
  int voxel;        ///< its index in the tile: i + kTile (j + kTile k)
  glm::vec3 place;  ///< undeformed place in cells; may be NaN
};

/// Working memory of a march, reused from tile to tile.
struct MarchScratch {
  static constexpr int kRows = static_cast<int>(kTile), kRoom = 16;               ///< lanes of the widest vectors
  static constexpr std::size_t kSlice = static_cast<std::size_t>(kTile * kTile);  ///< voxels of a slice of a tile

  /// Undeformed place, in cells, from which the next voxel of each column is expected to come.
  float x[kSlice + kRoom], y[kSlice + kRoom], z[kSlice + kRoom];
  /// Voxels of one slice that could not be settled at once: their places, in cells, and their numbers in the tile.
  struct Queue {
    float x[kSlice + kRoom], y[kSlice + kRoom], z[kSlice + kRoom];
    std::int32_t voxel[kSlice + kRoom];
    int count = 0;
  } queue;
  std::vector<Unsettled> unsettled;  ///< voxels of the whole tile that were not settled
};

/// A box of up to kTile voxels on each axis. Whole vectors are read and written, so all arrays have
/// `MarchScratch::kRoom` elements more than the box has voxels. Either `offset` or `fixed` is null.
struct MarchTile {
  IntBox box;            ///< its voxels in the output
  const Owners* owners;  ///< number of owners of each voxel, i fastest
  glm::vec3* offset;     ///< gets the undeformed minus deformed place of each voxel, voxels, i fastest
  /// Of a coarse field in which no vertex moves as far as 255 voxels: get U of each voxel, 2^-23 voxel, i fastest.
  std::int32_t* fixed[3] = {};
};

/// Finds the owners of those voxels of a tile that have exactly one, with the widest vectors that the processor has
/// (Highway). docs/design/glossary.md explains march, claim and settle, docs/design/cpu.md the method.
///
/// It goes along k, as the march on a device does. Each owner is predicted from the affine map of the one
/// before, and accepted where float arithmetic proves it (`try_tetrahedron`) or, at a second look, double arithmetic.
/// Offsets have the bits of `interpolate_u`, for they are computed by the same operations. Voxels whose owner is not
/// found are listed in `scratch.unsettled`. What is written of voxels that have none or several owners is undefined.
///
/// @param field    displacements and the lattice, which must have cells
/// @param nudge    where the nudge changes its sign
/// @param tile     which voxels, and how many owners each has
/// @param scratch  working memory, one for each thread; gets the voxels that are left
void march(const VectorField& field, const NudgeTurns& nudge, const MarchTile& tile, MarchScratch& scratch);

}  // namespace tetwarp::cpu
