// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/core/row_interval.h"
#include "deform/cpu/rows/fixed_list.h"

namespace tetwarp::cpu {

/// Some tetrahedra that are set up together, one a lane of a vector.
class TetrahedronBatch {
 public:
  static constexpr int kMost = 16;

  bool is_full() const { return count_ == kMost; }
  int count() const { return count_; }
  void clear() { count_ = 0; }
  void add(std::uint64_t number, const Tetrahedron& t);

  std::uint64_t number(int n) const { return number_[n]; }
  const Tetrahedron& tetrahedron(int n) const { return tetrahedra_[n]; }
  /// The corners, one tetrahedron a lane: of A, B, C, D, along i, j, k. What lies behind the last tetrahedron is some
  /// earlier one's.
  struct Corners {
    alignas(64) std::int32_t at[4][3][kMost];
  };
  const Corners& deformed() const { return deformed_; }
  const Corners& u() const { return u_; }

 private:
  int count_ = 0;
  Corners deformed_{}, u_{};
  std::uint64_t number_[kMost];
  Tetrahedron tetrahedra_[kMost];
};

/// A tetrahedron over a tile whose voxels are all nudged alike.
struct TileTetrahedron {
  IntBox reached;   ///< the voxels that its box may hold, counted from the first of the tile
  bool fits_int64;  ///< `has_int64_rows`
  RowFaces faces;   ///< where it `fits_int64`; `lower` is 0 where it may have no volume
};

/// How the tetrahedra of a batch lie over a tile (`detail::candidates`, `make_row_faces`), with the widest vectors that
/// the processor has (Highway).
/// @param first  first voxel of the tile  @param signs  its nudge  @param size  its voxels
void find_in_tile(const TetrahedronBatch& batch, const glm::ivec3& first, const glm::i32vec3& signs,
                  const glm::ivec3& size, TileTetrahedron (&tetrahedra)[TetrahedronBatch::kMost]);

/// The maps of a batch over a tile; where a map `is_thin`, it is not usable.
struct TileMaps {
  TileMap map[TetrahedronBatch::kMost];
  bool is_thin[TetrahedronBatch::kMost];
};

/// `CoarseMap` of the tetrahedra of a batch, with the widest vectors that the processor has (Highway).
/// @param first  voxel of the tile
void find_maps(const TetrahedronBatch& batch, const glm::ivec3& first, TileMaps& maps);

}  // namespace tetwarp::cpu
