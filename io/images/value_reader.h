// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the voxels of MHA and NRRD, checked as far as the file lets them be.
#include <cstdint>
#include <filesystem>
#include <memory>

#include "io/images/image_reader.h"

namespace tetwarp {

enum class Encoding : std::uint8_t {
  raw,    ///< the bytes of memory
  zlib,   ///< the same in one stream of zlib
  gzip,   ///< in one or more members of gzip
  text,   ///< each value in decimal digits
  hex,    ///< each byte in two hexadecimal digits
  bzip2,  ///< which is known by name, and not read
};

/// How the values lie in the file, from `StoredVoxels::offset` on.
struct ValueLayout {
  Encoding encoding = Encoding::raw;
  bool big_endian = false;
  std::uint64_t skip = 0;         ///< plain bytes before the values, of gzip
  std::uint64_t plane_count = 1;  ///< voxels of which all first components come first, then all second ones, and so on
};

/// The reader throws InputError for data that end too soon or are damaged. A zlib stream and gzip data must have right
/// check sums, hold exactly the values, and end the file, which MetaIO and NrrdIO of ITK 5.2.1 do not ask: they take a
/// truncated stream for whole, leave what it lacks of the buffer as it was, and look at no check sum of gzip.
std::unique_ptr<ImageReader> make_value_reader(const std::filesystem::path& path, ImageHeader header,
                                               const StoredVoxels& stored, const ValueLayout& layout);

}  // namespace tetwarp
