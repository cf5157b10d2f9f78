// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "deform/core/sample_voxel.h"
#include "deform/cpu/voxels.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

struct LinearPlaces;  // linear_row.h

/// Slices of a source that the voxels of a tile came from, for each slice of the tile.
using TileSlices = std::array<SliceRange, kTile>;

/// Samples one source, on any grid, at the undeformed places of voxels.
class TargetSampler {
 public:
  virtual ~TargetSampler() = default;
  /// Writes a row of the output and adds to the counts.
  /// @param places    what samplers of the same row share
  /// @param coverage  gets 1 or 0 for each voxel, unless null
  virtual void sample(const Row& row, LinearPlaces& places, std::uint8_t* coverage, Report& counts) const = 0;
  /// Writes the voxels of a list and adds to the counts.
  /// @param slices  grow by what was sampled, unless null
  virtual void sample(const VoxelList& list, LinearPlaces& places, std::uint8_t* coverage, Report& counts,
                      TileSlices* slices) const = 0;
  /// Writes the background to a run of voxels along i, and adds to the counts.
  virtual void clear(const glm::i64vec3& voxel, int count, Report& counts) const = 0;
  /// Whether `note` is wanted.
  virtual bool wants_slices() const = 0;
  /// Takes note of what a tile was sampled from. @param begin  its first slice
  virtual void note(std::int64_t begin, const TileSlices& slices) const = 0;
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
/// The same of a list of voxels. @param slices  of each target; those grow that want slices
void sample_targets(const VoxelList& list, const TargetSamplers& samplers, std::uint8_t* coverage, Report& report,
                    TileSlices* slices);
/// Writes the background of all targets to a run of voxels along i, to which nothing maps.
void clear_targets(const glm::i64vec3& voxel, int count, const TargetSamplers& samplers, Report& report);

}  // namespace tetwarp::cpu
