// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/cpu/sampler.h"

namespace tetwarp::cpu {

/// The map of a tetrahedron of a coarse field over a tile, modulo 2^32: U = at + along_i x + along_j y + along_k z at
/// voxel (x, y, z) of the tile. Each array has a number for each axis of U, and one more, so that vectors hold it.
struct alignas(16) TileMap {
  std::int32_t at[4], along_i[4], along_j[4], along_k[4];

  /// @param first  voxel of the tile
  TileMap(const CoarseMap& map, const glm::ivec3& first);
};

/// Voxels of a row that one tetrahedron owns, counted from the tile.
struct RowRun {
  int begin, end;
  const TileMap* map;
};

/// Computes U of the voxels of some runs of row y, z of a tile, with the widest vectors that the processor has
/// (Highway). What lies behind a run, up to `kMostInRow`, may be written too, so runs come from left to right.
/// @param u  along i, j, k
void fill_fixed_row(const RowRun* runs, int count, int y, int z, std::int32_t (&u)[3][kMostInRow]);

}  // namespace tetwarp::cpu
