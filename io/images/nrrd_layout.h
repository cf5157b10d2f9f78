// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: how the voxels of an NRRD file lie in it.
#include <filesystem>
#include <optional>

#include "io/images/text_header.h"
#include "io/images/value_reader.h"

namespace tetwarp {

/// The layout of an attached NRRD whose data are raw or gzip; nothing for text, hexadecimal digits and bzip2.
/// @param offset  receives where the data begin, with "line skip" and "byte skip" counted
/// @throws InputError for fields that contradict each other or the file
std::optional<ValueLayout> nrrd_layout(const std::filesystem::path& path, const TextHeader& text,
                                       const ImageHeader& header, std::uint64_t& offset);

/// ITK makes up a direction for an axis whose step is NaN, which files of old have for axes that lie in no space.
/// @throws InputError where "space directions" are there and fewer than three of them are numbers
void require_known_steps(const TextHeader& text, const std::string& file);

}  // namespace tetwarp
