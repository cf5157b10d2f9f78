// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/transform_file.h"

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "deform/errors.h"
#include "io/fields/field_format.h"
#include "io/fields/transform_format.h"
#include "io/opened_file.h"

namespace tetwarp {

namespace {

const TransformFormat* format_of(const std::filesystem::path& path) {
  std::string first;
  if (is_file(path)) {
    first.resize(kFirstBytes);
    std::ifstream stream(path, std::ios::binary);  // whoever reads the file says why it cannot be read
    stream.read(first.data(), static_cast<std::streamsize>(first.size()));
    first.resize(static_cast<std::size_t>(stream.gcount()));
  }
  return find_transform_format(path, first);
}

/// @throws InputError for a file of no format
const TransformFormat& format_of(const FieldSource& source) {
  const TransformFormat* format = format_of(source.path);
  require(format != nullptr, "not a transform file, " + source.path.string());
  return *format;
}

/// Checks the option that all formats have.
void check_invert(const FieldSource& source) {
  const std::string inverse = source.option("invert", "no");
  require(inverse == "yes" || inverse == "no",
          "invert=" + inverse + ", " + source.path.string() + "; expected yes or no");
}

/// Checks the other options.
void check_options(const TransformFormat& format, const FieldSource& source) {
  FieldSource others = source;
  others.options.erase("invert");
  if (format.check_options) return format.check_options(others);
  require(others.options.empty(), [&] {
    return "the option \"" + others.options.begin()->first + "\", " + source.path.string() +
           "; this format takes invert alone";
  });
}

/// The map of an affine transform. Its columns are differences over 200 mm, so that rounding stays below that of the
/// numbers themselves.
AffineMap map_of(const TransformFile& transform) {
  constexpr double kStep = 100;  // mm
  AffineMap map{glm::dmat3(1), transform.displacement(glm::dvec3(0))};
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 to(0);
    to[axis] = kStep;
    map.linear[axis] += (transform.displacement(to) - transform.displacement(-to)) / (2 * kStep);
  }
  return map;
}

/// @throws InputError for a map with numbers that are not finite, or without an inverse to speak of
void require_invertible(const AffineMap& map, const std::string& file) {
  constexpr double kFlat = 1e-9;  // of the volume that the three columns would span at right angles
  double largest = 1;
  for (int axis = 0; axis < 3; ++axis) largest *= glm::length(map.linear[axis]);
  const double volume = std::abs(glm::determinant(map.linear));
  require(std::isfinite(volume) && std::isfinite(glm::length(map.offset)) && volume > kFlat * largest,
          "a matrix without an inverse (determinant " + std::to_string(volume) + "), " + file +
              "; a transform maps different points to different ones");
}

/// @throws InputError for a transform that is not affine
void invert(TransformFile& transform, const std::string& file) {
  require(transform.affine, "invert=yes, " + file +
                                ": of the transforms only affine ones can be inverted; give the inverse that the tool "
                                "writes, or use tetwarp invert");
  transform.displacement = affine_transform(inverse_of(map_of(transform))).displacement;
  transform.inverted = true;
  transform.direction.reset();  // whoever inverts a transform knows in which of its two volumes points begin
}

}  // namespace

TransformFile affine_transform(const AffineMap& map) {
  TransformFile result;
  result.parameters = 12;
  result.affine = true;
  result.displacement = [map](const glm::dvec3& point) { return map(point) - point; };
  result.outside = std::make_shared<std::atomic<std::uint64_t>>(0);
  return result;
}

bool is_transform_file(const std::filesystem::path& path) {
  std::error_code ignored;  // set for a name that no file can have
  return !std::filesystem::is_directory(path, ignored) && format_of(path) != nullptr;
}

void check_transform_options(const FieldSource& source) {
  check_invert(source);
  if (is_file(source.path)) check_options(format_of(source), source);  // else whoever reads it says so
}

std::vector<std::filesystem::path> files_of_transform(const FieldSource& source) {
  std::vector<std::filesystem::path> files = {source.path};
  const TransformFormat& format = format_of(source);
  if (format.add_files) format.add_files(source, files);
  return files;
}

TransformFile read_transform_file(const FieldSource& source, const std::stop_token& stop) {
  check_invert(source);
  const TransformFormat& format = format_of(source);
  if (is_file(source.path)) check_options(format, source);
  TransformFile transform = format.read(source, stop);
  if (transform.affine) require_invertible(map_of(transform), source.path.string());
  if (source.option("invert") == "yes") invert(transform, source.path.string());
  return transform;
}

}  // namespace tetwarp
