#pragma once

// Private to io/. MHA and NRRD at their plainest (little endian, in the same file), for builds without ITK.
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "io/image_reader.h"

namespace tetwarp {

/// MHA and NRRD without ITK. @throws InputError for anything but little-endian voxels of a 3-D grid, raw or (MHA)
/// compressed
std::unique_ptr<ImageReader> open_raw_image(const std::filesystem::path& path, ImageFormat format);

/// The header of MHA or NRRD, up to the voxels, which follow raw.
std::string raw_image_header(ImageFormat format, const Geometry& grid, VoxelType type, int components,
                             const std::map<std::string, std::string>& metadata);

}  // namespace tetwarp
