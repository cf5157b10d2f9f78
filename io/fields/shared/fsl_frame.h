// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. The coordinates of FSL.
#include "deform/geometry.h"

namespace tetwarp {

/// The map from FSL's coordinates of an image to LPS mm. They are its voxel indices times its voxel sizes, in mm; the
/// first axis is turned about, from its last voxel on, where the axes of the image are right-handed ("neurological")
/// (FSL, "What coordinates does FLIRT use?").
AffineMap lps_from_fsl(const Geometry& image);
/// Its inverse.
AffineMap fsl_from_lps(const Geometry& image);

}  // namespace tetwarp
