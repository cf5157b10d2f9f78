// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/resampler.h"

namespace tetwarp {

/// Distance of each sample of a grid from the nearest marked one, mm, i fastest; infinite where none is marked. Exact,
/// and the same for any number of threads (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions",
/// Theory of Computing 8, 2012).
/// @param grid    whose axes are perpendicular
/// @param marked  not 0: marked; one a sample, i fastest
/// @param limits  number of threads
/// @throws InputError for another number of marks
std::vector<double> distance_mm(const Geometry& grid, const std::vector<std::uint8_t>& marked,
                                const Limits& limits = {});

}  // namespace tetwarp
