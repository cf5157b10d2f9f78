// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/nrrd_layout.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

#include "deform/errors.h"
#include "io/lower_case.h"

namespace tetwarp {
namespace {

std::vector<std::string> words(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> all;
  for (std::string word; stream >> word;) all.push_back(word);
  return all;
}

/// A field that has two spellings; 0 where it is absent.
std::int64_t whole_number(const TextHeader& text, const char* name, const char* other, const std::string& file) {
  const std::string value = text[name] + text[other];
  std::int64_t number = 0;
  const char* const end = value.data() + value.size();
  require(value.empty() || std::from_chars(value.data(), end, number).ptr == end,
          "the field \"" + std::string(name) + "\" is \"" + value.substr(0, 60) + "\", " + file +
              "; expected a whole number");
  return number;
}

/// Where a file goes on behind so many lines.
std::uint64_t behind_lines(const std::filesystem::path& path, std::uint64_t offset, std::int64_t lines) {
  std::ifstream stream(path, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(offset));
  for (; lines > 0 && stream; --lines) stream.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  require(stream.good(), "fewer lines than \"line skip\" says, " + path.string() + "; is the file whole?");
  return static_cast<std::uint64_t>(stream.tellg());
}

/// Voxels of which the first component comes before the second of any: the product of the axes before that of the
/// components.
std::uint64_t plane_count(const TextHeader& text, const ImageHeader& header) {
  if (header.components == 1) return 1;
  const std::vector<std::string> kinds = words(lower(text["kinds"]));
  const auto is_place = [](const std::string& kind) {
    return kind == "domain" || kind == "space" || kind == "time" || kind == "none" || kind == "???";
  };
  const auto axis = std::find_if_not(kinds.begin(), kinds.end(), is_place) - kinds.begin();
  std::uint64_t count = 1;
  for (int n = 0; n < std::min<std::ptrdiff_t>(axis, 3); ++n)
    count *= static_cast<std::uint64_t>(header.geometry.size[n]);
  return axis < std::ssize(kinds) ? count : 1;
}

}  // namespace

void require_known_steps(const TextHeader& text, const std::string& file) {
  std::string steps = lower(text["space directions"]);
  if (steps.empty()) return;
  std::ranges::replace(steps, ')', ' ');
  std::istringstream vectors(steps);
  int known = 0;
  for (std::string vector; std::getline(vectors, vector, '(');) {
    const bool is_vector = vector.find(',') != std::string::npos;
    known += is_vector && vector.find("nan") == std::string::npos && vector.find("inf") == std::string::npos;
  }
  require(known >= 3, "\"space directions\" with steps of " + std::to_string(known) + " axes, " + file +
                          "; expected those of 3, correct the header");
}

std::optional<ValueLayout> nrrd_layout(const std::filesystem::path& path, const TextHeader& text,
                                       const ImageHeader& header, std::uint64_t& offset) {
  const std::string file = path.string(), encoding = lower(text["encoding"]), endian = lower(text["endian"]);
  const bool raw = encoding == "raw", gzip = encoding == "gzip" || encoding == "gz";
  if (!raw && !gzip) return std::nullopt;
  ValueLayout layout{.encoding = gzip ? Encoding::gzip : Encoding::raw,
                     .big_endian = false,
                     .skip = 0,
                     .plane_count = plane_count(text, header)};
  const std::size_t value_bytes = size_bytes(header.type);
  require(value_bytes == 1 || endian == "little" || endian == "big",
          "the field \"endian\" is \"" + text["endian"] + "\", " + file + "; expected little or big");
  layout.big_endian = value_bytes > 1 && endian == "big";
  const std::int64_t lines = whole_number(text, "line skip", "lineskip", file),
                     bytes = whole_number(text, "byte skip", "byteskip", file);
  require(lines >= 0 && bytes >= (raw ? -1 : 0), "line skip " + std::to_string(lines) + " and byte skip " +
                                                     std::to_string(bytes) + " of " + encoding + " data, " + file +
                                                     "; expected 0 or more (of raw data, byte skip -1 too)");
  offset = lines > 0 ? behind_lines(path, text.data_offset, lines) : text.data_offset;
  if (gzip) {
    layout.skip = static_cast<std::uint64_t>(bytes);
  } else if (bytes >= 0) {
    offset += static_cast<std::uint64_t>(bytes);
  } else {
    const std::uint64_t held = std::filesystem::file_size(path),
                        needed = static_cast<std::uint64_t>(voxel_count(header.geometry)) *
                                 static_cast<std::uint64_t>(header.components) * value_bytes;
    offset = std::max(offset, held - std::min(held, needed));
  }
  return layout;
}

}  // namespace tetwarp
