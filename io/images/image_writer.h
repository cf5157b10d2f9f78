// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the formats behind `create_image`.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "io/image_file.h"
#include "io/images/image_reader.h"

namespace tetwarp {

/// Bytes that wait on the disk for their place in a file. Their own file has no name: it is gone with this object,
/// however the program ends.
class Spool {
 public:
  /// @param beside  the file that is written; @param suffix  makes another name of its. @throws Error
  Spool(const std::filesystem::path& beside, const std::string& suffix);
  std::ostream& out() { return file_; }
  /// Copies all that was written; a failed read or write leaves `to` in its fail state.
  void copy_to(std::ostream& to);

 private:
  std::fstream file_;
};

/// @param descrip  up to 79 characters
/// @param level    of libdeflate, 0 to 9, for a name in .gz
std::unique_ptr<ImageWriter> create_nifti(const std::filesystem::path& path, const Geometry& grid, VoxelType type,
                                          int components, const std::string& descrip, int level);

/// NRRD and MHA.
/// @param header  with its last line; of compressed MHA, the number in "CompressedDataSize = " is filled in
/// @param level   of zlib, 1 to 9; otherwise the voxels are stored as they are
std::unique_ptr<ImageWriter> create_text_image(const std::filesystem::path& path, ImageFormat format,
                                               const Geometry& grid, VoxelType type, int components, std::string header,
                                               int level);

/// Gives the line that begins with `name` in a text header another value. @throws Error where there is none
void set_text_field(std::string& header, const std::string& name, const std::string& value);

}  // namespace tetwarp
