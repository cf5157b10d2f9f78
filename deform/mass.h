// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "deform/resampler.h"

namespace tetwarp {

/// In what values of a type are resampled before mass is preserved: float32, or float64 where float32 does not hold
/// them all.
VoxelType type_of_mass(VoxelType type);

/// Values of a CT after a deformation that keeps mass: tissue that is squeezed into half the volume is twice as dense.
///
/// Density is HU + 1000 (air 0, water 1000), so a voxel becomes (HU + 1000) / |J| - 1000 with the determinant J of its
/// owner's forward map; computed in double, rounded to nearest, ties to even, and saturated where the type is an
/// integer's. What is no density keeps its value: the background where the source gave none (coverage 0), though the
/// voxel may have an owner and a determinant; padding; and a voxel without a determinant (NaN). Where the map folds,
/// mass is not kept: a voxel shows one of its owners.
///
/// @param hu        float32 or float64, as resampled
/// @param maps      `coverage` and `jacobian` of the same call, of which `hu` was the first target; they may buffer
///                  `slices` and no more
/// @param padding   of the source: values that are no data
/// @param output    any type; only `slices`, whole ones, are read and written. All on one grid, in host memory, the two
///                  volumes whole
/// @return how many values were saturated
std::uint64_t preserve_mass(const ConstVolumeView& hu, const Maps& maps, const std::optional<PaddingRange>& padding,
                            const VolumeView& output, const Region& slices);

}  // namespace tetwarp
