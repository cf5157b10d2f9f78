// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "deform/core/coarse_map.h"
#include "deform/core/sample_voxel.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

constexpr int kMostInRow = 64;  ///< largest number of voxels that are sampled together; tiles have shorter rows

/// U of the voxels of a row of a coarse field: undeformed minus deformed place in whole numbers of 2^-23 voxel. Where
/// they fit 32 bits they are kept in these, else in 64.
struct FixedRow {
  const std::int32_t* u[3] = {};     ///< along i, j, k; null where 64 bits are wanted
  const std::int64_t* wide[3] = {};  ///< the same; null otherwise

  bool is_wide() const { return u[0] == nullptr; }
  FixedOffset at(int i) const {
    return fixed_offset(is_wide() ? glm::i64vec3(wide[0][i], wide[1][i], wide[2][i])
                                  : glm::i64vec3(u[0][i], u[1][i], u[2][i]));
  }
};

/// A run of output voxels along i, and what the field says of each.
struct Row {
  glm::i64vec3 voxel;  ///< the first voxel of the run
  int count;
  const std::uint8_t* mapped;  ///< 1: the voxel comes from `voxel + offset`; 0: nothing maps there
  /// Undeformed minus deformed place of each, voxels of output index; null for a coarse field.
  const glm::vec3* offset;
  const FixedRow* fixed = nullptr;  ///< the same of a coarse field, else null
};

struct LinearPlaces;  // linear_row.h

/// Samples one source, on any grid, at the undeformed places of rows.
class TargetSampler {
 public:
  virtual ~TargetSampler() = default;
  /// Writes a row of the output and adds to the counts.
  /// @param places    what samplers of the same row share
  /// @param coverage  gets 1 or 0 for each voxel, unless null
  virtual void sample(const Row& row, LinearPlaces& places, std::uint8_t* coverage, Report& counts) const = 0;
  /// Whether voxels of a box that stay where they are can be copied.
  virtual bool can_copy(const Region& box) const = 0;
  /// Copies the voxels of a box and adds to the counts.
  virtual void copy(const Region& box, Report& counts) const = 0;
};

using TargetSamplers = std::vector<std::unique_ptr<const TargetSampler>>;

/// Checks all targets of a call and makes their samplers. The targets' views must outlive them.
TargetSamplers make_samplers(const Resampler& resampler, std::span<const Target> targets, const Region& region);

/// Sends a row through all targets. The report counts the voxels of the first.
/// @param coverage  gets 1 or 0 for each voxel: whether the first target has a value there, or, without targets,
///         whether the field maps something there
void sample_targets(const Row& row, const TargetSamplers& samplers, std::uint8_t* coverage, Report& report);

}  // namespace tetwarp::cpu
