// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads B-spline transforms of NiftyReg.
#include "io/fields/transform_format.h"
#include "io/images/nifti_file.h"

namespace tetwarp {

/// Whether a header is that of a cubic B-spline control point grid of NiftyReg (intent_name NREG_TRANS, intent_p1 2).
bool is_niftyreg_spline(const NiftiHeader& header);

/// Reads cubic B-spline control point grids of NiftyReg as the maps that they are, from output to input
/// (reg-lib/cpu/_reg_localTrans.cpp, reg_spline_getDeformationField). Control points are positions in RAS mm. The point
/// at grid index u is blended from those at floor(u) - 1 to floor(u) + 2 on each axis, with the weights of the uniform
/// cubic B-spline. The grid lies where its sform says, if it has one. Beyond the grid its outermost control points are
/// repeated, with the same displacement. Refused are fewer than 4 control points on an axis, one that is not finite,
/// and header extensions, in which NiftyReg holds affine maps.
extern const TransformFormat kTransformFormat_niftyreg;

}  // namespace tetwarp
