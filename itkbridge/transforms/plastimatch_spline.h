// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string_view>

#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

/// The first bytes of a file with a B-spline of plastimatch.
inline constexpr std::string_view kPlastimatchMagic = "MGH_GPUIT_BSP";

/// Reads a B-spline of plastimatch (text) as a BSplineTransform of ITK. plastimatch maps output to input.
///
/// The header has the image's grid and the voxels per region. A region is one spacing of the coefficients. The first
/// coefficient lies one spacing before the region of interest, and on each axis there are three more coefficients than
/// regions. Values: all x, all y, all z, one a line. The grid begins up to 6e-8 of the origin (0.00002 mm) before the
/// place that the header states, since the header rounds it.
/// @throws InputError naming the file and what is missing or wrong
TransformRecord read_plastimatch_spline(const std::filesystem::path& path);

}  // namespace tetwarp
