// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: where a NIfTI file that is written says that its voxels lie.
#include <array>

#include "deform/geometry.h"

namespace tetwarp {

/// The numbers of both forms (nifti1.h, methods 2 and 3), RAS mm. Both have the rotation that is nearest to the grid's
/// direction, in the arithmetic of niftilib (https://nifti.nimh.nih.gov), float32 for the most part: so that the bytes
/// are those that niftilib writes, and all readers place the voxels alike.
struct NiftiForms {
  std::array<float, 3> quatern{};  ///< b, c, d of a unit quaternion
  std::array<float, 3> offset{};   ///< of voxel (0, 0, 0)
  float qfac = 1;                  ///< -1: the third axis is mirrored beside the quaternion's
  std::array<std::array<float, 4>, 3> srow{};
};

NiftiForms nifti_forms(const Geometry& grid);

}  // namespace tetwarp
