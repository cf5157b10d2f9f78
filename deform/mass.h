#pragma once

#include "deform/volume.h"

namespace tetwarp {

/// Values of a CT after a deformation that keeps mass: tissue that is squeezed into half the volume is twice as dense.
///
/// Density is HU + 1000 (air 0, water 1000), so a voxel becomes (HU + 1000) / |J| - 1000 with the determinant J of its
/// owner's forward map; computed in double, rounded to nearest, ties to even, and saturated where the type is an
/// integer's. A voxel without a determinant (NaN) keeps its value. Where the map folds, mass is not kept: a voxel shows
/// one of its owners.
///
/// @param hu        float32, as resampled
/// @param jacobian  float32, `Maps::jacobian` of the same call; may buffer `slices` and no more
/// @param output    any type; only `slices`, whole ones, are read and written. All three on one grid, in host memory,
/// the
///                  two volumes whole
/// @return how many values were saturated
std::uint64_t preserve_mass(const ConstVolumeView& hu, const ConstVolumeView& jacobian, const VolumeView& output,
                            const Region& slices);

}  // namespace tetwarp
