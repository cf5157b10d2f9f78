// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads warps of FreeSurfer (.mgz, .mgh), which also mri_synthmorph writes.
#include "io/fields/field_format.h"

namespace tetwarp {

extern const FieldFormat kFieldFormat_mgz;

}  // namespace tetwarp
