// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. MHA and NRRD at their plainest (little endian, in the same file), for builds without ITK; and where
// an NRRD lies, for all builds.
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "io/images/image_reader.h"
#include "io/images/text_header.h"

namespace tetwarp {

/// MHA and NRRD without ITK. @throws InputError for anything but little-endian voxels of a 3-D grid, raw or (MHA)
/// compressed
std::unique_ptr<ImageReader> open_raw_image(const std::filesystem::path& path, ImageFormat format);

/// The field "space" of an NRRD, in lower case; of the three that a patient has, each in its short form: lps, ras, las.
std::string nrrd_space(const TextHeader& text);

/// Origin, spacing and direction, LPS, by the fields "space", "space origin" and "space directions" of an NRRD.
/// @throws InputError for spaces other than LPS, RAS and LAS, and for anything but nine and three finite numbers
void place_nrrd(Geometry& grid, const TextHeader& text, const std::string& file);

/// The header of MHA or NRRD, up to the voxels, which follow raw.
std::string raw_image_header(ImageFormat format, const Geometry& grid, VoxelType type, int components,
                             const std::map<std::string, std::string>& metadata);

}  // namespace tetwarp
