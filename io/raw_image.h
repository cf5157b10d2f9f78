#pragma once

// Private to io/. MHA and NRRD at their plainest (little endian, in the same file), for builds without ITK.
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "io/image_reader.h"

namespace tetwarp {

/// Voxels as they lie in the file, little endian; `stored.encoded`: as one zlib stream (compressed MHA), whose check
/// sum must be right. MetaIO of ITK 5.2.1 takes a truncated stream for whole and leaves the rest of the buffer as it
/// was.
std::unique_ptr<ImageReader> make_raw_reader(const std::filesystem::path& path, ImageHeader header,
                                             const Stored& stored);

/// MHA and NRRD without ITK. @throws InputError for anything but little-endian voxels of a 3-D grid, raw or (MHA)
/// compressed
std::unique_ptr<ImageReader> open_raw_image(const std::filesystem::path& path, ImageFormat format);

/// The header of MHA or NRRD, up to the voxels, which follow raw.
std::string raw_image_header(ImageFormat format, const Geometry& grid, VoxelType type, int components,
                             const std::map<std::string, std::string>& metadata);

}  // namespace tetwarp
