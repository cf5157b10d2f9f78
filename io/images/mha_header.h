// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what the header of an MHA file (https://itk.org/Wiki/MetaIO/Documentation) says of the volume.
#include <map>
#include <string>

#include "io/images/text_header.h"
#include "io/images/value_reader.h"

namespace tetwarp {

/// Grid, type and components. Where the header says less than it may, MetaIO's defaults count: spacing 1 (or
/// ElementSize), origin 0, the patient's axes.
/// @throws InputError naming the file, for what is not a 3-D grid of numbers of a VoxelType, and for numbers that are
///         none
ImageHeader parse_mha_header(const TextHeader& text, const std::string& file);

/// How the voxels lie behind the header.
/// @throws InputError for voxels that are text or compressed in big endian, and where HeaderSize or CompressedDataSize
///         is not what the file has
ValueLayout mha_layout(const std::filesystem::path& path, const TextHeader& text);

/// The lines before the voxels of a file that is written, as MetaIO writes them.
/// @param compressed  then the line "CompressedDataSize = 0" is there; the number is to be filled in
std::string mha_header(const Geometry& grid, VoxelType type, int components,
                       const std::map<std::string, std::string>& metadata, bool compressed);

}  // namespace tetwarp
