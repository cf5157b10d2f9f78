// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/nrrd_layout.h"

#include <algorithm>
#include <fstream>
#include <limits>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "io/images/header_words.h"
#include "io/lower_case.h"

namespace tetwarp {
namespace {

/// 0 where the field is absent.
std::int64_t whole_number(const TextHeader& text, const char* name, const std::string& file) {
  const std::string value = trimmed(text[name]);
  const auto number = value.empty() ? std::int64_t{0} : number_from<std::int64_t>(value);
  require(number.has_value(), "the field \"" + std::string(name) + "\" is \"" + value.substr(0, 60) + "\", " + file +
                                  "; expected a whole number");
  return *number;
}

/// Where a file goes on behind so many lines.
std::uint64_t behind_lines(const std::filesystem::path& path, std::uint64_t offset, std::int64_t lines) {
  std::ifstream stream(path, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(offset));
  for (; lines > 0 && stream; --lines) stream.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  require(stream.good(), "fewer lines than \"line skip\" says, " + path.string() + "; is the file whole?");
  return static_cast<std::uint64_t>(stream.tellg());
}

}  // namespace

ValueLayout nrrd_layout(const std::filesystem::path& path, const TextHeader& text, const NrrdHeader& header,
                        std::uint64_t& offset) {
  const std::string file = path.string();
  const bool raw = header.encoding == Encoding::raw;
  ValueLayout layout{
      .encoding = header.encoding, .big_endian = header.big_endian, .skip = 0, .plane_count = header.plane_count};
  const std::int64_t lines = whole_number(text, "line skip", file), bytes = whole_number(text, "byte skip", file);
  require(lines >= 0 && bytes >= (raw ? -1 : 0),
          "line skip " + std::to_string(lines) + " and byte skip " + std::to_string(bytes) + " of " +
              lower(text["encoding"]) + " data, " + file + "; expected 0 or more (of raw data, byte skip -1 too)");
  offset = lines > 0 ? behind_lines(path, text.data_offset, lines) : text.data_offset;
  if (header.encoding == Encoding::gzip) {
    layout.skip = static_cast<std::uint64_t>(bytes);
  } else if (bytes >= 0) {
    offset += static_cast<std::uint64_t>(bytes);
  } else {
    const ImageHeader& image = header.image;
    const std::uint64_t held = std::filesystem::file_size(path),
                        needed = static_cast<std::uint64_t>(voxel_count(image.geometry)) *
                                 static_cast<std::uint64_t>(image.components) * size_bytes(image.type);
    offset = std::max(offset, held - std::min(held, needed));
  }
  return layout;
}

}  // namespace tetwarp
