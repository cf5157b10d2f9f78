// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to resamplers.

#include <cstdint>
#include <span>
#include <vector>

#include "deform/core/region.h"

namespace tetwarp {

/// The voxels that marked tiles have: a region for each run of tiles along i.
/// @param marked  not 0 where a tile counts, i fastest  @param tiles  how many on each axis
/// @param size    voxels of a tile  @param origin  first voxel of the first tile  @param all  to which regions are cut
std::vector<Region> regions_of_tiles(std::span<const std::uint8_t> marked, const glm::i64vec3& tiles,
                                     const glm::i64vec3& size, const glm::i64vec3& origin, const Region& all);

}  // namespace tetwarp
