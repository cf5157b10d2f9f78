// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. The text headers of MHA (https://itk.org/Wiki/MetaIO/Documentation) and NRRD
// (https://teem.sourceforge.net/nrrd/format.html).
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "io/images/image_reader.h"

namespace tetwarp {

/// The lines before the voxels.
struct TextHeader {
  std::map<std::string, std::string> fields;    ///< names in lower case; NRRD: the basic fields ("name: value")
  std::map<std::string, std::string> metadata;  ///< NRRD: "key:=value"; MHA: the fields that MetaIO does not define
  std::uint64_t data_offset = 0;                ///< of the first byte after the header

  /// The field's value; empty where it is absent.
  std::string operator[](const std::string& name) const;
};

/// @throws InputError for a file that is not of the format, whose header does not end, whose voxels lie in another
/// file, or
///         whose lengths are not mm
TextHeader read_text_header(const std::filesystem::path& path, ImageFormat format);

/// Whether the voxels are stored otherwise than as plain bytes.
bool is_encoded(const TextHeader& header, ImageFormat format);
/// Whether binary MHA has its values in big endian.
bool is_big_endian(const TextHeader& header);
/// Checks the sizes that the header of an MHA file states.
/// @throws InputError where HeaderSize or CompressedDataSize is not what the file has
void require_stated_sizes(const std::filesystem::path& path, const TextHeader& header);
/// Whether the voxels are one zlib stream: compressed MHA, little endian.
bool is_zlib(const TextHeader& header, ImageFormat format);

}  // namespace tetwarp
