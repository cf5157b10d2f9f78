// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the frame of coordinates as 3D Slicer states it in titles and comments of meshes.
#include <optional>
#include <string>
#include <string_view>

#include "io/points_file.h"

namespace tetwarp {

/// @throws InputError where a file has said another frame before
void require_same_space(std::optional<PointFrame> before, PointFrame said, const std::string& name);

/// What follows "SPACE=" in a text, "RAS" or "LPS"; none where that is not in it.
/// @param name  of the file, for messages
/// @throws InputError for another word than these two, or where both stand
std::optional<PointFrame> slicer_space(std::string_view text, const std::string& name);

}  // namespace tetwarp
