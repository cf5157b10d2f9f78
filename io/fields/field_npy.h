// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Displacements in a NumPy array file
// (https://numpy.org/doc/stable/reference/generated/numpy.lib.format), versions 1.0 to 3.0: an array of four axes, the
// last of which has the three components. The file says neither which axis is which, nor the units, nor where it lies:
// the first two are given, the place is the volume's.
#include "io/fields/field_format.h"

namespace tetwarp {

/// Options: order=zyx|xyz (the axes of the array's shape), units=mm|voxel; and, where the default is wrong,
/// components=xyz|zyx (default xyz), frame=lps|ras (default lps; of mm alone). Voxels are along the grid's i, j, k.
extern const FieldFormat kFieldFormat_npy;

}  // namespace tetwarp
