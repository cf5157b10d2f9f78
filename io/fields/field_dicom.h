// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads Deformable Spatial Registration objects of DICOM (PS3.3 A.39.2, C.20.3): a grid of offsets,
// with an affine map before it and another after it.
#include "io/fields/field_format.h"

namespace tetwarp {

/// Option: item=N, an item of the Deformable Registration Sequence, from 1. It is needed where several items have a
/// grid, each for another source frame of reference.
extern const FieldFormat kFieldFormat_dicom;

}  // namespace tetwarp
