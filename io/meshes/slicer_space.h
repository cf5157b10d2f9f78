// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the frame of coordinates that 3D Slicer states in titles and comments of meshes.
#include <optional>
#include <string>
#include <string_view>

#include "io/points_file.h"

namespace tetwarp {

/// Refuses a file that states two frames. @param before  what it stated before, if anything
/// @throws InputError where `before` is another frame than `said`
void require_same_space(std::optional<PointFrame> before, PointFrame said, const std::string& name);

/// The frame that follows "SPACE=" in a text, RAS or LPS; none where the text does not have it.
/// @param name  of the file, for messages
/// @throws InputError for another word than these two, or where both are stated
std::optional<PointFrame> slicer_space(std::string_view text, const std::string& name);

}  // namespace tetwarp
