// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/cpu/voxels.h"

namespace tetwarp::cpu {

/// The map of a tetrahedron of a coarse field over a tile, modulo 2^32: U = at + along[0] x + along[1] y + along[2] z
/// at voxel (x, y, z) of the tile.
struct TileMap {
  glm::i32vec3 at, along[3];

  TileMap() = default;
  /// @param first  voxel of the tile
  TileMap(const CoarseMap& map, const glm::ivec3& first);
};

/// Computes U of some voxels of a tile, with the widest vectors that the processor has (Highway). Up to `kRoomBehind`
/// numbers behind the last voxel may be read, and as many of U be written.
/// @param numbers  of the voxels, `VoxelList::numbers`
/// @param u        along i, j, k
void fill_fixed_list(const TileMap& map, const std::uint16_t* numbers, int count, std::int32_t* const (&u)[3]);

}  // namespace tetwarp::cpu
