// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/mha_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>

#include "deform/errors.h"
#include "io/images/header_words.h"
#include "io/lower_case.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

/// The first numbers of a field; what follows them does not count, as for MetaIO.
std::vector<double> numbers(const TextHeader& text, const std::string& name, std::size_t count,
                            const std::string& file) {
  const std::vector<std::string> all = words(text[name]);
  std::vector<double> values;
  for (std::size_t n = 0; n < count; ++n) {
    const double value = n < all.size() ? to_number(all[n]).value_or(NAN) : NAN;
    require(std::isfinite(value),
            "unreadable header (" +
                (n < all.size() ? "\"" + shown(all[n].substr(0, 60)) + "\"" : std::to_string(n) + " numbers") +
                " in the field " + name + "), " + file + "; expected " + std::to_string(count) +
                (count == 1 ? " number" : " numbers"));
    values.push_back(value);
  }
  return values;
}

/// Those of the last of some fields that is there; nothing where none is.
std::optional<std::vector<double>> last_of(std::initializer_list<const char*> names, const TextHeader& text,
                                           std::size_t count, const std::string& file) {
  std::optional<std::vector<double>> found;
  for (const char* name : names) {
    if (text.fields.contains(name)) found = numbers(text, name, count, file);
  }
  return found;
}

std::int64_t whole_number(double value, const std::string& name, const std::string& file) {
  require(std::abs(value) <= std::numeric_limits<std::int32_t>::max() && value == std::floor(value),
          "unreadable header (" + std::to_string(value) + " in the field " + name + "), " + file +
              "; expected a whole number");
  return static_cast<std::int64_t>(value);
}

/// What MetaIO calls the types, in the order of VoxelType.
constexpr std::array<const char*, 8> kTypes = {"MET_UCHAR", "MET_CHAR", "MET_USHORT", "MET_SHORT",
                                               "MET_UINT",  "MET_INT",  "MET_FLOAT",  "MET_DOUBLE"};

/// MetaIO's long has 32 bits. A type of arrays is one of their numbers: the channels make the vector.
VoxelType voxel_type(std::string name, const std::string& file) {
  constexpr std::string_view kArray = "_ARRAY";
  if (name.ends_with(kArray)) name.resize(name.size() - kArray.size());
  if (name == "MET_LONG" || name == "MET_ULONG") name.replace(name.size() - 4, 4, "INT");
  if (name == "MET_ASCII_CHAR" || name == "MET_STRING") name = "MET_CHAR";
  if (name == "MET_FLOAT_MATRIX") name = "MET_FLOAT";
  const auto found = std::ranges::find(kTypes, name);
  if (found != kTypes.end()) return static_cast<VoxelType>(found - kTypes.begin());
  const std::string shown = name == "MET_LONG_LONG" ? "int64" : name == "MET_ULONG_LONG" ? "uint64" : "unknown";
  throw InputError("voxels of type " + shown + ", " + file + "; expected integers of 8 to 32 bits, float32 or float64");
}

int component_count(const TextHeader& text, const std::string& file) {
  constexpr const char* kField = "elementnumberofchannels";
  if (!text.fields.contains(kField)) return 1;
  const std::int64_t channels = whole_number(numbers(text, kField, 1, file)[0], kField, file);
  const bool is_matrix = text["elementtype"] == "MET_FLOAT_MATRIX";
  const std::int64_t count = is_matrix ? channels * channels : channels;
  require(count <= std::numeric_limits<int>::max(), std::to_string(channels) + " components a voxel, " + file);
  return static_cast<int>(count);
}

/// Where an axis of the grid points from, of the six ways of a patient: "RAI" for the axes of LPS. It is what MetaIO
/// says of a direction beside TransformMatrix, which decides.
char origin_side(const glm::dvec3& column) {
  constexpr double kAlong = 0.001;  // of a unit vector
  const glm::dvec3 size(std::abs(column.x), std::abs(column.y), std::abs(column.z));
  int axis = 0;
  if (size.y > kAlong && size.y > size.x && size.y > size.z) axis = 1;
  if (size.z > kAlong && size.z > size.x && size.z > size.y) axis = 2;
  constexpr std::array<std::array<char, 2>, 3> kSides = {{{'R', 'L'}, {'A', 'P'}, {'I', 'S'}}};
  return kSides[static_cast<std::size_t>(axis)][column[axis] < 0 ? 1 : 0];
}

std::string anatomical_orientation(const glm::dmat3& direction) {
  std::string sides, axes;
  for (int axis = 0; axis < 3; ++axis) {
    const char side = origin_side(direction[axis]);
    sides += side;
    axes += side == 'R' || side == 'L' ? 'x' : side == 'A' || side == 'P' ? 'y' : 'z';
  }
  std::ranges::sort(axes);
  return axes == "xyz" ? sides : "RPI";  // of axes that share a side of the patient, ITK says this
}

bool says_true(const TextHeader& text, const char* field) { return lower(text[field]) == "true"; }

/// @throws InputError where HeaderSize or CompressedDataSize is not what the file has
void require_stated_sizes(const std::filesystem::path& path, const TextHeader& text, bool compressed) {
  const auto require_size = [&](const char* name, std::initializer_list<std::string> expected) {
    const std::string stated = text[name];
    require(stated.empty() || std::ranges::find(expected, stated) != expected.end(),
            std::string(name) + " is " + stated.substr(0, 60) + ", " + path.string() + "; the file has " +
                *expected.begin() + ", is it whole?");
  };
  require_size("headersize", {std::to_string(text.data_offset), "0", "-1"});
  if (!compressed) return;
  require_size("compresseddatasize", {std::to_string(std::filesystem::file_size(path) - text.data_offset)});
}

}  // namespace

ImageHeader parse_mha_header(const TextHeader& text, const std::string& file) {
  const std::int64_t axes = whole_number(numbers(text, "ndims", 1, file)[0], "ndims", file);
  require(axes == 3, "an image of " + std::to_string(axes) + " axes, " + file + "; expected 3");
  ImageHeader header;
  header.metadata = text.metadata;
  header.type = voxel_type(text["elementtype"], file);
  header.components = component_count(text, file);
  const auto size = numbers(text, "dimsize", 3, file);
  const auto spacing = last_of({"elementsize", "elementspacing"}, text, 3, file).value_or(std::vector<double>(3, 1));
  const auto origin =
      last_of({"position", "offset", "origin", "imageposition"}, text, 3, file).value_or(std::vector<double>(3, 0));
  const auto matrix = last_of({"orientation", "rotation", "transformmatrix"}, text, 9, file);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    header.geometry.size[axis] = whole_number(size[a], "dimsize", file);
    header.geometry.spacing[axis] = spacing[a];
    header.geometry.origin[axis] = origin[a];
    for (int row = 0; matrix && row < 3; ++row)
      header.geometry.direction[axis][row] = snapped_cosine((*matrix)[3 * a + static_cast<std::size_t>(row)]);
  }
  return header;
}

ValueLayout mha_layout(const std::filesystem::path& path, const TextHeader& text) {
  const bool big_endian = says_true(text, "binarydatabyteordermsb") || says_true(text, "elementbyteordermsb"),
             compressed = says_true(text, "compresseddata"), is_text = lower(text["binarydata"]) == "false",
             zlib = compressed && !is_text && !big_endian;
  require_stated_sizes(path, text, zlib);
  require(zlib || (!compressed && !is_text), "voxels that are text, or compressed big-endian, " + path.string() +
                                                 "; expected binary, compressed only in little endian");
  return {.encoding = zlib ? Encoding::zlib : Encoding::raw, .big_endian = big_endian};
}

std::string mha_header(const Geometry& grid, VoxelType type, int components,
                       const std::map<std::string, std::string>& metadata, bool compressed) {
  const glm::dmat3& d = grid.direction;
  std::ostringstream out;
  out << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
      << (compressed ? "CompressedData = True\nCompressedDataSize = 0\n" : "CompressedData = False\n")
      << "TransformMatrix = " << exact(d[0], " ") << ' ' << exact(d[1], " ") << ' ' << exact(d[2], " ") << '\n'
      << "Offset = " << exact(grid.origin, " ") << "\nCenterOfRotation = 0 0 0\n"
      << "AnatomicalOrientation = " << anatomical_orientation(d) << '\n'
      << "ElementSpacing = " << exact(grid.spacing, " ") << '\n';
  for (const auto& [key, value] : metadata) {
    if (!value.empty()) out << key << " = " << value << '\n';  // MetaIO cannot read a field without a value
  }
  out << "DimSize = " << grid.size.x << ' ' << grid.size.y << ' ' << grid.size.z << '\n';
  if (components > 1) out << "ElementNumberOfChannels = " << components << '\n';
  out << "ElementType = " << kTypes[static_cast<std::size_t>(type)] << "\nElementDataFile = LOCAL\n";
  return out.str();
}

}  // namespace tetwarp
