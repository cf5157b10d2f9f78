// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads fields in NIfTI-1 files: vectors (intent 1007) as ITK and ANTs write them, displacement vectors
// (1006, DISPVECT), and NiftyReg's deformation and displacement fields.
#include "io/fields/field_format.h"

namespace tetwarp {

extern const FieldFormat kFieldFormat_nifti;

}  // namespace tetwarp
