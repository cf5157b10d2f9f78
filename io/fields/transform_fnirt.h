// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads coefficients of FSL's fnirt: a cubic B-spline between two images, whose headers are read as
// well.
#include "io/fields/transform_format.h"

namespace tetwarp {

extern const TransformFormat kTransformFormat_fnirt;

}  // namespace tetwarp
