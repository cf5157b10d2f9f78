// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads what ITK evaluates: its own transforms and those of elastix and plastimatch.
#include "io/fields/transform_format.h"

namespace tetwarp {

extern const TransformFormat kTransformFormat_itk;

}  // namespace tetwarp
