// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads warps of MRtrix in its own format, .mif and .mif.gz: an image of four axes, the last of which
// has the three components.
#include "io/fields/field_format.h"

namespace tetwarp {

/// Option: values=displacements|positions, which must be given, for the file does not say which it has.
extern const FieldFormat kFieldFormat_mif;

}  // namespace tetwarp
