// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads displacements in a NumPy array file
// (https://numpy.org/doc/stable/reference/generated/numpy.lib.format), versions 1.0 to 3.0: an array of four axes, the
// last of which has the three components. The file says neither which axis is which, nor its units, nor where the grid
// lies. Options give the first two; the grid is that of the volume.
#include "io/fields/field_format.h"

namespace tetwarp {

/// Options: order=zyx|xyz (the axes of the array's shape), units=mm|voxel; and, where the default is wrong,
/// components=xyz|zyx (default xyz), frame=lps|ras (default lps; only for units=mm). Vectors in voxels are along the
/// grid's i, j, k.
extern const FieldFormat kFieldFormat_npy;

}  // namespace tetwarp
