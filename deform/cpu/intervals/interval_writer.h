// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "deform/cpu/intervals/interval_tile.h"
#include "deform/cpu/map_writer.h"
#include "deform/cpu/rows/fixed_list.h"
#include "deform/cpu/sampler.h"

namespace tetwarp::cpu {

/// In which form the undeformed places of a field's voxels are computed.
struct PlaceForm {
  bool is_coarse;  ///< in fixed point (`CoarseMap`), else in float (`TetrahedronMap`)
  bool is_wide;    ///< whether fixed point wants more than 32 bits

  /// @param most_moved  largest displacement of a vertex on an axis, 2^-12 voxel
  PlaceForm(bool coarse, std::int32_t most_moved) : is_coarse(coarse), is_wide(most_moved >= kFarForInt32) {}
};

/// What a tile is written to, the same for all tiles of a call.
struct TileTargets {
  const TargetSamplers& samplers;
  const MapWriter& maps;
  PlaceForm form;
  const Nudge& nudge;
};

/// Samples the voxels of a tile as their owners are found, tetrahedron after tetrahedron, and writes their maps. Voxels
/// of several tetrahedra are sampled together.
class IntervalWriter final : public IntervalSink {
 public:
  /// Owners of the tile, which the caller finds.
  IntervalTile tile;

  /// The next tile. @param targets  must outlive the work on it
  void prepare(const TileTargets& targets) { to_ = &targets; }
  /// Writes what is left of the tile, once all its owners are found.
  /// @param stays  `stays(y, z)` has a bit for each voxel of a row that stays where it is unless it has an owner; y and
  ///               z count from the tile
  template <class Stays>
  void finish(Stays&& stays, Report& report) {
    const glm::i64vec3 size = tile.box().end - tile.box().begin;
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) finish_row(y, z, stays(y, z));
    }
    write_list();
    finish_tile(report);
  }

  void begin() override;
  void meet(const TetrahedronBatch& batch) override;
  void take(const OwnedRows& owned) override;

 private:
  template <class Fill>
  void append(const std::uint16_t* rows, const std::uint32_t* bits, int count, const Fill& fill);
  void find_places(const OwnedRows& owned, int from);
  void stay(int from);
  void finish_row(int y, int z, std::uint32_t stays);
  void finish_tile(Report& report);
  void write_list();

  const TileTargets* to_ = nullptr;
  Report report_;
  std::vector<TileSlices> slices_;  ///< of each target
  TileMaps maps_;                   ///< of a batch
  int count_ = 0;                   ///< voxels in the list
  // Of each voxel in the list:
  alignas(64) std::uint16_t numbers_[kRoomTogether];
  alignas(64) std::int32_t u_[3][kRoomTogether];  ///< of a coarse field, where 32 bits hold it
  std::int64_t wide_[3][kRoomTogether];           ///< otherwise
  glm::vec3 offset_[kRoomTogether];
  std::uint8_t coverage_[kRoomTogether];
  float jacobian_[kRoomTogether];
  std::uint32_t tetrahedra_[kRoomTogether];
};

}  // namespace tetwarp::cpu
