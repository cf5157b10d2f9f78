// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <span>

#include "deform/contours/polygon.h"

namespace tetwarp {

struct ZeroContours {
  std::vector<Ring> rings;  ///< counterclockwise around what is inside, clockwise around holes; in samples
  bool cut = false;         ///< what is inside goes on to the border of the grid, or to samples that are not known
};

/// Where samples of a plane pass through zero, by marching squares (Lorensen and Cline's marching cubes in two
/// dimensions), straight between neighbours. Samples >= 0 are inside. NaN is not known: outside, and the contour goes
/// half way to it; so is everything beyond the grid. Where the corners of a square are inside crosswise, their mean
/// decides whether they are joined.
/// @param values  i fastest, columns x rows
ZeroContours zero_contours(std::span<const double> values, std::int64_t columns, std::int64_t rows);

}  // namespace tetwarp
