// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/raw_image.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <sstream>
#include <utility>

#include "deform/errors.h"
#include "io/images/text_header.h"
#include "io/images/value_reader.h"
#include "io/lower_case.h"

namespace tetwarp {
namespace {

/// The whole text as numbers; parentheses and commas (NRRD vectors) count as spaces. @throws InputError
std::vector<double> numbers(const TextHeader& header, const std::string& name, const std::string& file) {
  std::string text = header[name];
  std::ranges::replace_if(
      text, [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  std::vector<double> values;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (word == "none") continue;
    char* end = nullptr;
    values.push_back(std::strtod(word.c_str(), &end));
    require(*end == '\0' && std::isfinite(values.back()),
            "\"" + word + "\" in the field \"" + name + "\", " + file + "; expected a number");
  }
  return values;
}

std::vector<double> numbers(const TextHeader& header, const std::string& name, std::size_t count,
                            const std::string& file) {
  const auto values = numbers(header, name, file);
  require(values.size() == count, std::to_string(values.size()) + " numbers in the field \"" + name + "\", " + file +
                                      "; expected " + std::to_string(count));
  return values;
}

std::int64_t whole_number(double value, const std::string& file) {
  require(value >= 1 && value < 9e15 && value == static_cast<double>(static_cast<std::int64_t>(value)),
          "a size of " + std::to_string(value) + ", " + file + "; expected a positive whole number");
  return static_cast<std::int64_t>(value);
}

int component_count(double value, const std::string& file) {
  const std::int64_t count = whole_number(value, file);
  require(count <= std::numeric_limits<int>::max(), std::to_string(count) + " components a voxel, " + file);
  return static_cast<int>(count);
}

void expect(const TextHeader& header, const std::string& name, const std::string& value, bool may_be_absent,
            const std::string& file) {
  const std::string found = header[name];
  require(
      lower(found) == value || (may_be_absent && found.empty()),
      "the field \"" + name + "\" is \"" + found + "\", " + file + "; without ITK only \"" + value + "\" can be read");
}

struct MetaType {
  VoxelType type;
  const char *mha, *nrrd;
};
constexpr std::array<MetaType, 8> kTypes = {{{VoxelType::u8, "MET_UCHAR", "uint8"},
                                             {VoxelType::i8, "MET_CHAR", "int8"},
                                             {VoxelType::u16, "MET_USHORT", "uint16"},
                                             {VoxelType::i16, "MET_SHORT", "int16"},
                                             {VoxelType::u32, "MET_UINT", "uint32"},
                                             {VoxelType::i32, "MET_INT", "int32"},
                                             {VoxelType::f32, "MET_FLOAT", "float"},
                                             {VoxelType::f64, "MET_DOUBLE", "double"}}};

/// NRRD has several names a type: "unsigned short int", "ushort", "uint16_t" are all uint16.
std::string nrrd_type(const std::string& text) {
  static const std::map<std::string, std::string> kNames = {{"uchar", "uint8"},
                                                            {"unsigned char", "uint8"},
                                                            {"uint8_t", "uint8"},
                                                            {"signed char", "int8"},
                                                            {"int8_t", "int8"},
                                                            {"ushort", "uint16"},
                                                            {"unsigned short", "uint16"},
                                                            {"unsigned short int", "uint16"},
                                                            {"uint16_t", "uint16"},
                                                            {"short", "int16"},
                                                            {"short int", "int16"},
                                                            {"signed short", "int16"},
                                                            {"signed short int", "int16"},
                                                            {"int16_t", "int16"},
                                                            {"uint", "uint32"},
                                                            {"unsigned int", "uint32"},
                                                            {"uint32_t", "uint32"},
                                                            {"int", "int32"},
                                                            {"signed int", "int32"},
                                                            {"int32_t", "int32"}};
  const auto found = kNames.find(text);
  return found == kNames.end() ? text : found->second;
}

VoxelType voxel_type(const std::string& name, ImageFormat format, const std::string& file) {
  for (const MetaType& entry : kTypes) {
    if (name == (format == ImageFormat::mha ? entry.mha : entry.nrrd)) return entry.type;
  }
  throw InputError("voxels of type \"" + name + "\", " + file + "; expected integers of 8 to 32 bits, float or double");
}

ImageHeader parse_mha(const TextHeader& text, const std::string& file) {
  expect(text, "ndims", "3", false, file);
  expect(text, "binarydatabyteordermsb", "false", true, file);
  expect(text, "elementbyteordermsb", "false", true, file);
  expect(text, "headersize", "0", true, file);
  ImageHeader header;
  header.metadata = text.metadata;
  header.type = voxel_type(text["elementtype"], ImageFormat::mha, file);
  if (!text["elementnumberofchannels"].empty()) {
    header.components = component_count(numbers(text, "elementnumberofchannels", 1, file)[0], file);
  }
  const auto size = numbers(text, "dimsize", 3, file), spacing = numbers(text, "elementspacing", 3, file);
  const auto offset = numbers(text, "offset", 3, file), matrix = numbers(text, "transformmatrix", 9, file);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    header.geometry.size[axis] = whole_number(size[a], file);
    header.geometry.spacing[axis] = spacing[a];
    header.geometry.origin[axis] = offset[a];
    header.geometry.direction[axis] = glm::dvec3(matrix[3 * a], matrix[3 * a + 1], matrix[3 * a + 2]);
  }
  return header;
}

ImageHeader parse_nrrd(const TextHeader& text, const std::string& file) {
  ImageHeader header;
  header.metadata = text.metadata;
  header.type = voxel_type(nrrd_type(lower(text["type"])), ImageFormat::nrrd, file);
  if (size_bytes(header.type) > 1) expect(text, "endian", "little", false, file);
  auto size = numbers(text, "sizes", file);
  require(size.size() == 3 || (size.size() == 4 && text["space directions"].starts_with("none")),
          std::to_string(size.size()) + " axes, " + file + "; expected 3, or 4 with the vectors' components first");
  if (size.size() == 4) {
    header.components = component_count(size[0], file);
    size.erase(size.begin());
  }
  place_nrrd(header.geometry, text, file);
  for (int axis = 0; axis < 3; ++axis)
    header.geometry.size[axis] = whole_number(size[static_cast<std::size_t>(axis)], file);
  return header;
}

/// As many digits as bring the same double back.
std::string exact(const glm::dvec3& v, const char* separator) {
  std::array<char, 96> text;
  std::snprintf(text.data(), text.size(), "%.17g%s%.17g%s%.17g", v.x, separator, v.y, separator, v.z);
  return text.data();
}

std::string mha_header(const Geometry& grid, VoxelType type, int components,
                       const std::map<std::string, std::string>& metadata) {
  const glm::dmat3& d = grid.direction;
  std::ostringstream out;
  out << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
      << "TransformMatrix = " << exact(d[0], " ") << ' ' << exact(d[1], " ") << ' ' << exact(d[2], " ") << '\n'
      << "Offset = " << exact(grid.origin, " ") << "\nElementSpacing = " << exact(grid.spacing, " ") << '\n';
  for (const auto& [key, value] : metadata) out << key << " = " << value << '\n';
  out << "DimSize = " << grid.size.x << ' ' << grid.size.y << ' ' << grid.size.z << '\n';
  if (components > 1) out << "ElementNumberOfChannels = " << components << '\n';
  out << "ElementType = " << kTypes[static_cast<std::size_t>(type)].mha << "\nElementDataFile = LOCAL\n";
  return out.str();
}

std::string nrrd_header(const Geometry& grid, VoxelType type, int components,
                        const std::map<std::string, std::string>& metadata) {
  const bool vectors = components > 1;
  std::ostringstream out;
  out << "NRRD0004\ntype: " << kTypes[static_cast<std::size_t>(type)].nrrd << "\ndimension: " << (vectors ? 4 : 3)
      << "\nspace: left-posterior-superior\nsizes:";
  if (vectors) out << ' ' << components;
  out << ' ' << grid.size.x << ' ' << grid.size.y << ' ' << grid.size.z
      << "\nspace directions:" << (vectors ? " none" : "");
  for (int axis = 0; axis < 3; ++axis) out << " (" << exact(grid.spacing[axis] * grid.direction[axis], ",") << ')';
  out << "\nkinds:" << (vectors ? " vector" : "")
      << " domain domain domain\nendian: little\nencoding: raw\nspace origin: (" << exact(grid.origin, ",") << ")\n";
  for (const auto& [key, value] : metadata) out << key << ":=" << value << '\n';
  out << '\n';
  return out.str();
}

}  // namespace

std::string nrrd_space(const TextHeader& text) {
  const std::string space = lower(text["space"]);
  if (space == "left-posterior-superior") return "lps";
  if (space == "right-anterior-superior") return "ras";
  if (space == "left-anterior-superior") return "las";
  return space;
}

void place_nrrd(Geometry& grid, const TextHeader& text, const std::string& file) {
  const std::string space = nrrd_space(text);
  const bool ras = space == "ras", las = space == "las";
  require(ras || las || space == "lps",
          "the space \"" + space + "\", " + file +
              "; without ITK only left-posterior-superior, right-anterior-superior and left-anterior-superior can be "
              "read");
  const auto steps = numbers(text, "space directions", 9, file), origin = numbers(text, "space origin", 3, file);
  const glm::dvec3 lps(ras ? -1 : 1, ras || las ? -1 : 1, 1);
  grid.origin = lps * glm::dvec3(origin[0], origin[1], origin[2]) + 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const glm::dvec3 step = lps * glm::dvec3(steps[3 * a], steps[3 * a + 1], steps[3 * a + 2]) + 0.0;
    grid.spacing[axis] = glm::length(step);
    grid.direction[axis] = step / grid.spacing[axis];
  }
}

std::unique_ptr<ImageReader> open_raw_image(const std::filesystem::path& path, ImageFormat format) {
  const TextHeader text = read_text_header(path, format);
  const std::string file = path.string();
  const bool zlib = is_zlib(text, format);
  if (format == ImageFormat::mha) require_stated_sizes(path, text);
  require(zlib || !is_encoded(text, format),
          "voxels that are compressed or text, " + file + "; without ITK only raw voxels can be read");
  require(text["byte skip"].empty() && text["line skip"].empty(),
          "a field \"byte skip\" or \"line skip\", " + file + "; without ITK neither can be read");
  ImageHeader header = format == ImageFormat::mha ? parse_mha(text, file) : parse_nrrd(text, file);
  const Stored stored{text.data_offset, size_bytes(header.type), zlib};
  return make_value_reader(path, std::move(header), stored, {.encoding = zlib ? Encoding::zlib : Encoding::raw});
}

std::string raw_image_header(ImageFormat format, const Geometry& grid, VoxelType type, int components,
                             const std::map<std::string, std::string>& metadata) {
  return format == ImageFormat::mha ? mha_header(grid, type, components, metadata)
                                    : nrrd_header(grid, type, components, metadata);
}

}  // namespace tetwarp
