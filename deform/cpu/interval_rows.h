// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "deform/cpu/interval_tile.h"
#include "deform/cpu/map_writer.h"
#include "deform/cpu/rows/fixed_row.h"
#include "deform/cpu/sampler.h"

namespace tetwarp::cpu {

/// In which form the undeformed places of a field's voxels are computed.
struct PlaceForm {
  bool is_coarse;  ///< in fixed point (`CoarseMap`), else in float (`TetrahedronMap`)
  bool is_wide;    ///< whether fixed point wants more than 32 bits

  /// @param most_moved  largest displacement of a vertex on an axis, 2^-12 voxel
  PlaceForm(bool coarse, std::int32_t most_moved) : is_coarse(coarse), is_wide(most_moved >= kFarForInt32) {}
};

/// Samples the rows of a tile whose owners are known as intervals, and writes their maps.
class IntervalRows {
 public:
  /// Owners of the next tile, which the caller finds.
  IntervalTile tile;

  /// Works on all rows of the tile.
  /// @param stays  `stays(y, z)` has a bit for each voxel of a row that stays where it is unless it has an owner; y and
  ///               z count from the tile
  template <class Stays>
  void write(const PlaceForm& form, const Nudge& nudge, const TargetSamplers& samplers, const MapWriter& maps,
             Stays&& stays, Report& report) {
    const Region& box = tile.box();
    prepare(form);
    if (maps.wants_owners()) report.multiply_owned = count_of_several(tile.counts());
    const auto width = static_cast<int>(box.end.x - box.begin.x);
    const std::uint32_t all = ~0u >> (32 - width);
    std::size_t first = 0;
    for (std::int64_t z = 0; z < box.end.z - box.begin.z; ++z) {
      for (std::int64_t y = 0; y < box.end.y - box.begin.y; ++y, first += static_cast<std::size_t>(width)) {
        const Row row{box.begin + glm::i64vec3(0, y, z), width, mapped_, form.is_coarse ? nullptr : offset_,
                      form.is_coarse ? &fixed_ : nullptr};
        find_places(form, nudge, row, y, z, stays(y, z) & all, maps, report);
        sample_targets(row, samplers, coverage_, report);
        maps.write(row, coverage_,
                   {jacobian_, maps.wants_owners() ? tile.counts().data() + first : nullptr, tetrahedra_});
      }
    }
  }

 private:
  void prepare(const PlaceForm& form);
  void find_places(const PlaceForm& form, const Nudge& nudge, const Row& row, std::int64_t y, std::int64_t z,
                   std::uint32_t stays, const MapWriter& maps, Report& report);
  void find_one_by_one(const Nudge& nudge, const Row& row, int begin, int end, std::size_t owner);
  void find_offsets(const Nudge& nudge, const Row& row, int begin, int end, const Tetrahedron& t);
  void clear(const PlaceForm& form, int i);

  std::vector<CoarseMap> maps_;     ///< of the owners of a coarse field
  std::vector<TileMap> tile_maps_;  ///< the same over the tile
  FixedRow fixed_;
  alignas(64) std::int32_t u_[3][kMostInRow];     ///< of the row, where 32 bits hold it
  alignas(64) std::int64_t wide_[3][kMostInRow];  ///< otherwise
  glm::vec3 offset_[kTile];
  std::uint8_t mapped_[kTile], coverage_[kTile];
  float jacobian_[kTile];
  std::uint32_t tetrahedra_[kTile];
};

}  // namespace tetwarp::cpu
