// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "deform/core/sample_voxel.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

/// A run of output voxels along i and what the field says of each.
struct Row {
  glm::i64vec3 voxel;  ///< the first
  int count;
  const std::uint8_t* mapped;  ///< 1: comes from `voxel + offset`; 0: nothing maps there
  const glm::vec3* offset;     ///< undeformed minus deformed, voxels of output index
};

struct LinearPlaces;  // linear_row.h

/// Samples one source at the undeformed places of rows. Its source may be on any grid.
class TargetSampler {
 public:
  virtual ~TargetSampler() = default;
  /// Writes a row of the output; adds to the counts. `coverage`, where not null, receives 1 or 0 a voxel.
  /// @param places  what samplers of the same row may share
  virtual void sample(const Row& row, LinearPlaces& places, std::uint8_t* coverage, Report& counts) const = 0;
  /// Whether voxels of a box that stay where they are can be copied.
  virtual bool can_copy(const Region& box) const = 0;
  /// Copies them; adds to the counts.
  virtual void copy(const Region& box, Report& counts) const = 0;
};

using TargetSamplers = std::vector<std::unique_ptr<const TargetSampler>>;

/// The samplers of all targets of one call, checked. The targets' views must outlive them.
TargetSamplers make_samplers(const Resampler& resampler, std::span<const Target> targets, const Region& region);

/// Sends a row through all targets; the report counts the voxels of the first. `coverage` receives 1 or 0 a voxel: of
/// the first target, or of the field where there is none.
void sample_targets(const Row& row, const TargetSamplers& samplers, std::uint8_t* coverage, Report& report);

}  // namespace tetwarp::cpu
