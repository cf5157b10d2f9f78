// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads 4 x 4 matrices in text, which say neither who wrote them nor in which frame they are:
// Convert3D, Greedy, NiftyReg, MRtrix and FSL's flirt.
#include <span>

#include "io/fields/transform_format.h"

namespace tetwarp {

extern const TransformFormat kTransformFormat_matrix;

/// The affine map of the upper three rows of a 4 x 4 matrix, row by row.
inline AffineMap map_of_rows(std::span<const double, 16> m) {
  return {glm::dmat3(m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]), {m[3], m[7], m[11]}};
}

/// The transform of a matrix that maps points in RAS mm, row by row.
/// @throws InputError naming the file, for a value that is not finite, or a last row other than 0 0 0 1
AffineMap lps_map_of_ras(std::span<const double, 16> matrix, const std::string& file);

}  // namespace tetwarp
