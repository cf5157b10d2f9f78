// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <span>

#include "deform/cpu/sampler.h"
#include "deform/resampler.h"

namespace tetwarp::cpu {

/// What a row of voxels has of its owners: a value for each voxel, or null where that map is not filled.
struct OwnerRow {
  const float* jacobian = nullptr;            ///< determinants
  const std::uint16_t* owners = nullptr;      ///< how many own it
  const std::uint32_t* tetrahedra = nullptr;  ///< the number of the one that does
};

/// Writes rows of the maps that a call of `Resampler::resample` fills: those of its `Maps` that have voxels. Several
/// threads may write different rows at a time.
class MapWriter {
 public:
  /// Checks the maps. @throws InputError for a map that is not on the output grid, does not buffer the region, or has
  /// the wrong type
  MapWriter(const Maps& maps, const Geometry& output, const Region& region);

  /// Whether any map is filled.
  bool wants_any() const {
    return maps_.coverage.voxels != nullptr || maps_.inverse_mm.voxels != nullptr || wants_of_owners();
  }
  /// Whether `write` needs Jacobian determinants.
  bool wants_jacobian() const { return maps_.jacobian.voxels != nullptr; }
  /// Whether `write` needs the number of owners of each voxel.
  bool wants_owners() const { return maps_.owners.voxels != nullptr; }
  /// Whether `write` needs the numbers of owners.
  bool wants_tetrahedra() const { return maps_.tetrahedra.voxels != nullptr; }
  /// Whether `write` needs anything of `OwnerRow`.
  bool wants_of_owners() const { return wants_jacobian() || wants_owners() || wants_tetrahedra(); }

  /// Writes one row of each map. The inverse displacement is computed from `row.offset`.
  /// @param row       its voxels, which the maps must buffer
  /// @param coverage  1 or 0 for each voxel of the row
  void write(const Row& row, const std::uint8_t* coverage, const OwnerRow& of_owners = {}) const;
  /// The same of a list of voxels, but for how many own each.
  void write(const VoxelList& list, const std::uint8_t* coverage, const OwnerRow& of_owners) const;
  /// Writes how many own each voxel of a row.
  void write_owners(const glm::i64vec3& voxel, int count, const std::uint16_t* owners) const;
  /// Writes to each map, but that, that nothing maps to a run of voxels along i.
  void clear(const glm::i64vec3& voxel, int count) const;

 private:
  Maps maps_;
  glm::dmat3 mm_from_index_;
};

/// How many voxels have several owners, for `Report::multiply_owned`. @param owners  how many each voxel has
std::uint64_t count_of_several(std::span<const std::uint16_t> owners);

}  // namespace tetwarp::cpu
