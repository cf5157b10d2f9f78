// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads linear transforms of FreeSurfer (.lta), which also mri_synthmorph writes: a matrix between the
// voxels or the RAS mm of two volumes, whose places the file has. They lead from the source (moving) to the destination
// (fixed) volume.
#include "io/fields/transform_format.h"

namespace tetwarp {

extern const TransformFormat kTransformFormat_lta;

}  // namespace tetwarp
