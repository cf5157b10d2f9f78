// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads the DICOM Spatial Registration object (PS3.3 C.20.2): matrices from the points of source frames
// of reference to those of the registered frame, which is the object's own. It leads from the moving to the fixed
// series.
#include "io/fields/transform_format.h"

namespace tetwarp {

extern const TransformFormat kTransformFormat_dicom;

}  // namespace tetwarp
