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
  /// Names in lower case. NRRD: the basic fields ("name: value"), each by one of its spellings ("block size", not
  /// "blocksize"), with blanks behind the value.
  std::map<std::string, std::string> fields;
  std::map<std::string, std::string> metadata;  ///< NRRD: "key:=value"; MHA: the fields that MetaIO does not define
  std::uint64_t data_offset = 0;                ///< of the first byte after the header

  /// The field's value; empty where it is absent.
  std::string operator[](const std::string& name) const;
};

/// @throws InputError for a file that is not of the format, whose header does not end, whose voxels lie in another
///         file, or whose lengths are not mm; of NRRD also for a field that comes twice, or before one that it needs
TextHeader read_text_header(const std::filesystem::path& path, ImageFormat format);

}  // namespace tetwarp
