// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/volume.h"

namespace tetwarp::viewer {

/// Most voxels on an axis of a volume that is drawn while something moves and there is no device.
constexpr std::int64_t kMostCoarseVoxels = 96;

/// Larger slices are made with fewer pixels while something moves and there is no device.
constexpr std::int64_t kMostMovingVoxels = 256;

/// For each axis how many voxels become one in the volume that moving slices are made of: two where there are more than
/// kMostMovingVoxels, in the plane of slices at uneven distances alone.
glm::i64vec3 moving_blocks(const Geometry& grid);

/// For each axis how many voxels become one, so that at most kMostCoarseVoxels are left. Slices at uneven distances
/// stay.
glm::i64vec3 coarse_blocks(const Geometry& grid);

/// The grid whose voxels lie in the middle of blocks of so many voxels; blocks at the end may be smaller.
Geometry coarse_grid(const Geometry& grid, const glm::i64vec3& blocks);

/// The volume with the mean of each block of voxels, on `coarse_grid` of its own grid. Padding counts as the other
/// values do.
/// @param volume  one component, the whole volume in host memory
AnyVolume coarse_volume(const ConstVolumeView& volume, const glm::i64vec3& blocks);

}  // namespace tetwarp::viewer
