// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string_view>

#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

/// How a B-spline of plastimatch begins.
inline constexpr std::string_view kPlastimatchMagic = "MGH_GPUIT_BSP";

/// Reads a B-spline of plastimatch (text) as the BSplineTransform of ITK that it is. plastimatch maps output to input.
///
/// Its header has the image's grid and the voxels per region; a region is one spacing of the coefficients, of which the
/// first lies one spacing before the region of interest, and there are three more than regions. Values: all x, all y,
/// all z, one a line. The grid begins up to 6e-8 of the origin (0.00002 mm) earlier than the header says, which rounds
/// it.
/// @throws InputError naming the file and what is missing or wrong
TransformRecord read_plastimatch_spline(const std::filesystem::path& path);

}  // namespace tetwarp
