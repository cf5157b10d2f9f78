// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/host_device.h"

namespace tetwarp {

/// Half-open box of voxels: a voxel is inside where begin <= voxel < end on every axis.
struct Region {
  glm::i64vec3 begin{0},  ///< first voxel (i, j, k)
      end{0};             ///< one after the last voxel on each axis

  /// Whether both corners are equal.
  friend bool operator==(const Region&, const Region&) = default;
};

/// Whether a box holds no voxel.
TETWARP_HD inline bool is_empty(const Region& region) {
  return region.end.x <= region.begin.x || region.end.y <= region.begin.y || region.end.z <= region.begin.z;
}

}  // namespace tetwarp
