// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "deform/resampler.h"

namespace tetwarp {

/// The voxel type in which values of `type` are resampled before `preserve_mass`: float32, or float64 where float32
/// does not hold all values of the type.
VoxelType type_of_mass(VoxelType type);

/// Gives a deformed CT the values that keep its mass: tissue squeezed into half its volume becomes twice as dense.
///
/// Density is HU + 1000 (0 for air, 1000 for water). A voxel becomes (HU + 1000) / |J| - 1000, where J is the Jacobian
/// determinant of its owner's forward map. It is computed in double, rounded to nearest, ties to even, and saturated
/// where the output type is an integer type. What is no density keeps its value: the background where the source gave
/// no value (coverage 0), even if the voxel has an owner; padding; and a voxel whose determinant is NaN. Where the map
/// folds mass is not kept, for a voxel shows only one of its owners.
///
/// All views lie on one grid and in host memory.
/// @param hu       the resampled volume, whole, float32 or float64
/// @param maps     `coverage` and `jacobian` of the call of `Resampler::resample` whose first target was `hu`; they may
///         buffer only `slices`
/// @param padding  stored values of the source that are no data
/// @param output   the result, a whole volume of any type
/// @param slices   whole slices; no others are read or written
/// @return how many values were saturated
std::uint64_t preserve_mass(const ConstVolumeView& hu, const Maps& maps, const std::optional<PaddingRange>& padding,
                            const VolumeView& output, const Region& slices);

}  // namespace tetwarp
