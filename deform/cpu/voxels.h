// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/core/coarse_map.h"
#include "deform/cpu/tiles.h"

namespace tetwarp::cpu {

/// U of some voxels of a coarse field: undeformed minus deformed place in whole numbers of 2^-23 voxel. Where they fit
/// 32 bits they are kept in these, else in 64.
struct FixedOffsets {
  const std::int32_t* u[3] = {};     ///< along i, j, k; null where 64 bits are wanted
  const std::int64_t* wide[3] = {};  ///< the same; null otherwise

  bool is_wide() const { return u[0] == nullptr; }
  FixedOffset at(int i) const {
    return fixed_offset(is_wide() ? glm::i64vec3(wide[0][i], wide[1][i], wide[2][i])
                                  : glm::i64vec3(u[0][i], u[1][i], u[2][i]));
  }
};

/// The most voxels that are sampled together, and what vectors may write behind the last of them.
constexpr int kMostTogether = 256, kRoomBehind = 64;
constexpr int kRoomTogether = kMostTogether + kRoomBehind;

/// A run of output voxels along i, and what the field says of each.
struct Row {
  glm::i64vec3 voxel;  ///< the first voxel of the run
  int count;
  const std::uint8_t* mapped;  ///< 1: the voxel comes from `voxel + offset`; 0: nothing maps there
  /// Undeformed minus deformed place of each, voxels of output index; null for a coarse field.
  const glm::vec3* offset;
  const FixedOffsets* fixed = nullptr;  ///< the same of a coarse field, else null

  glm::i64vec3 voxel_at(int i) const { return voxel + glm::i64vec3(i, 0, 0); }
  bool is_mapped(int i) const { return mapped[i] != 0; }
};

/// Output voxels of a tile in any order, up to `kMostTogether`, all of which the field maps.
struct VoxelList {
  glm::i64vec3 first;  ///< first voxel of the tile
  int count;
  /// Of each voxel: x + 32 y + 1024 z, counted from the first; `kRoomTogether` of them.
  const std::uint16_t* numbers;
  /// Undeformed minus deformed place of each, voxels of output index; null for a coarse field.
  const glm::vec3* offset;
  const FixedOffsets* fixed;  ///< the same of a coarse field, else null

  static constexpr int kAxisBits = 5;
  static_assert(kTile == 1 << kAxisBits);

  static glm::ivec3 in_tile(unsigned number) {
    return {number % kTile, number >> kAxisBits & (kTile - 1), number >> (2 * kAxisBits)};
  }
  glm::ivec3 in_tile_at(int i) const { return in_tile(numbers[i]); }
  glm::i64vec3 voxel_at(int i) const { return first + glm::i64vec3(in_tile_at(i)); }
  static bool is_mapped(int) { return true; }
};

}  // namespace tetwarp::cpu
