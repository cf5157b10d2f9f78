// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/cpu/sampler.h"
#include "deform/resampler.h"

namespace tetwarp::cpu {

/// Writes rows of those maps that a call asked to fill.
class MapWriter {
 public:
  /// @throws InputError for a map that is not on the output grid, does not buffer the region, or has the wrong type
  MapWriter(const Maps& maps, const Geometry& output, const Region& region);

  bool wants_any() const {
    return maps_.coverage.voxels != nullptr || maps_.inverse_mm.voxels != nullptr || wants_jacobian() || wants_owners();
  }
  bool wants_jacobian() const { return maps_.jacobian.voxels != nullptr; }
  bool wants_owners() const { return maps_.owners.voxels != nullptr; }

  /// Writes one row.
  /// @param coverage  1 or 0 for each voxel of the row
  /// @param jacobian  one for each voxel, or null if that map is not filled
  /// @param owners    one for each voxel, or null if that map is not filled
  void write(const Row& row, const std::uint8_t* coverage, const float* jacobian, const std::uint16_t* owners) const;

 private:
  Maps maps_;
  glm::dmat3 mm_from_index_;
};

}  // namespace tetwarp::cpu
