// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads a field that is an array of an archive of NumPy (.npz), as VoxelMorph and other networks write
// warps.
#include "io/fields/field_format.h"

namespace tetwarp {

extern const FieldFormat kFieldFormat_npz;

}  // namespace tetwarp
