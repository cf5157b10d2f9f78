// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads B-spline transforms of NiftyReg.
#include "io/images/nifti_file.h"
#include "io/transform_file.h"

namespace tetwarp {

/// Whether a header is that of a cubic B-spline control point grid of NiftyReg (intent_name NREG_TRANS, intent_p1 2).
bool is_niftyreg_spline(const NiftiHeader& header);

/// Reads a cubic B-spline control point grid of NiftyReg as the map that it is, from output to input
/// (reg-lib/cpu/_reg_localTrans.cpp, reg_spline_getDeformationField). Control points are positions in RAS mm. The point
/// at grid index u is blended from those at floor(u) - 1 to floor(u) + 2 on each axis, with the weights of the uniform
/// cubic B-spline. The grid lies where its sform says, if it has one. Beyond the grid its outermost control points are
/// repeated, with the same displacement.
/// @throws InputError naming the file, for fewer than 4 control points on an axis, one that is not finite, or header
/// extensions (in which NiftyReg holds affine maps)
TransformFile read_niftyreg_spline(const std::filesystem::path& path);

}  // namespace tetwarp
