// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/field_file.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <utility>

#include "deform/errors.h"
#include "deform/fields/lattice_mesh.h"
#include "io/fields/field_format.h"
#include "io/fields/field_image.h"
#include "io/mesh_writer.h"
#include "io/opened_file.h"

namespace tetwarp {
namespace {

/// Whether a path exists; false also for a name that no file can have, for which std::filesystem throws.
bool is_there(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

/// The format that recognizes the file; null: none does.
const FieldFormat* format_of(const std::filesystem::path& path) {
  if (!is_file(path)) return find_field_format(path, "");
  std::string first(kFirstBytes, '\0');
  std::ifstream stream = opened(path);
  stream.read(first.data(), static_cast<std::streamsize>(first.size()));
  first.resize(static_cast<std::size_t>(stream.gcount()));
  return find_field_format(path, first);
}

const FieldFormat& required_format(const std::filesystem::path& path) {
  const FieldFormat* format = format_of(path);
  require(format != nullptr || is_there(path), "no such file, " + path.string());
  require(format != nullptr, "not a field file, " + path.string() +
                                 "; expected .mha .nrrd .nii .nii.gz .mgz .mif .mif.gz .npy .npz .vts .vti .vtr "
                                 ".vtk, or a DICOM Deformable Spatial Registration");
  return *format;
}

std::unique_ptr<FieldReader> open_field(const FieldSource& source) {
  check_field_options(source);
  return required_format(source.path).open(source);
}

/// Refuses displacements that are not finite. @param gaps  whether a displacement may be NaN: the file has none there
void require_finite(const std::vector<glm::vec3>& displacement, const Geometry& grid, bool gaps,
                    const std::string& file) {
  const auto is_good = [gaps](float value) { return std::isfinite(value) || (gaps && std::isnan(value)); };
  for (std::size_t v = 0; v < displacement.size(); ++v) {
    const glm::vec3& d = displacement[v];
    if (is_good(d.x) && is_good(d.y) && is_good(d.z)) continue;
    const auto n = static_cast<std::int64_t>(v);
    throw InputError("a displacement that is not finite (" + std::to_string(d.x) + ", " + std::to_string(d.y) + ", " +
                     std::to_string(d.z) + ") at vertex (" + std::to_string(n % grid.size.x) + ", " +
                     std::to_string(n / grid.size.x % grid.size.y) + ", " +
                     std::to_string(n / (grid.size.x * grid.size.y)) + "), " + file + "; every vertex needs a number");
  }
}

FieldFile read_as(const FieldSource& source, std::optional<Direction> wanted) {
  const std::string file = source.path.string();
  const auto reader = open_field(source);
  const FieldFileHeader& header = reader->header();
  require(!wanted || !header.direction || *wanted == *header.direction,
          "a " + (header.direction ? to_string(*header.direction) : "") + " field where a " +
              (wanted ? to_string(*wanted) : "") + " field is expected, " + file + "; " +
              (wanted == Direction::forward ? "give it with --pull-field, or invert it" : "give it with -f"));
  FieldFile field{header.grid, {}, header.direction};
  field.displacement.resize(static_cast<std::size_t>(voxel_count(field.grid)));
  reader->read(field.displacement);
  require_finite(field.displacement, field.grid,
                 wanted.value_or(field.direction.value_or(Direction::forward)) == Direction::pull, file);
  return field;
}

void write_as(const std::filesystem::path& path, const Geometry& grid, const std::vector<glm::vec3>& displacement,
              Direction direction, const Control& control) {
  require(displacement.size() == static_cast<std::size_t>(voxel_count(grid)),
          std::to_string(displacement.size()) + " displacements for " + to_string(grid.size) + " vertices, " +
              path.string());
  create_field_file(path, grid, direction)
      ->write_whole({&grid, whole(grid), VoxelType::f32, 3, std::as_bytes(std::span(displacement)).data()}, control);
}

}  // namespace

std::string to_string(Direction direction) { return direction == Direction::forward ? "forward" : "pull"; }

std::string to_string(FieldBasis basis) {
  switch (basis) {
    case FieldBasis::stated: return "stated";
    case FieldBasis::by_format: return "by the format";
    case FieldBasis::by_option: return "by an option";
    case FieldBasis::assumed: break;
  }
  return "assumed";
}

std::string FieldSource::option(const std::string& key, const std::string& otherwise) const {
  const auto found = options.find(key);
  return found == options.end() ? otherwise : found->second;
}

FieldSource parse_field_source(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (is_there(text) || colon == std::string::npos || text.find('=', colon) == std::string::npos) return {text};
  FieldSource source(text.substr(0, colon));
  std::istringstream options(text.substr(colon + 1));
  for (std::string option; std::getline(options, option, ',');) {
    const std::size_t equals = option.find('=');
    require(equals != std::string::npos && equals > 0 && equals + 1 < option.size(),
            "the option \"" + option + "\" of " + source.path.string() + "; expected KEY=VALUE");
    require(source.options.emplace(option.substr(0, equals), option.substr(equals + 1)).second,
            "the option \"" + option.substr(0, equals) + "\" of " + source.path.string() + " is given twice");
  }
  return source;
}

void check_field_options(const FieldSource& source) {
  const FieldFormat* format = format_of(source.path);
  if (format == nullptr) return;  // a file of no known format is refused when it is read
  require(!source.options.contains("invert"), "invert= is for affine transforms, " + source.path.string() +
                                                  " is a field; tetwarp invert writes the inverse of one");
  if (format->check_options) return format->check_options(source);
  require(source.options.empty(), "the option \"" + (source.options.empty() ? "" : source.options.begin()->first) +
                                      "\" for " + source.path.string() + "; files of its format take none");
}

bool is_field_file(const FieldSource& source) {
  const FieldFormat* format = format_of(source.path);
  return format && (!format->holds_field || format->holds_field(source));
}

FieldFileHeader read_field_header(const FieldSource& source) { return open_field(source)->header(); }

FieldFile read_field_file(const FieldSource& source) { return read_as(source, std::nullopt); }

VertexField read_forward_field(const FieldSource& source) {
  FieldFile field = read_as(source, Direction::forward);
  return {field.grid, std::move(field.displacement)};
}

PullField read_pull_field(const FieldSource& source) {
  FieldFile field = read_as(source, Direction::pull);
  return {field.grid, std::move(field.displacement)};
}

void write_field_file(const std::filesystem::path& path, const VertexField& field, const Control& control) {
  write_as(path, field.lattice, field.displacement, Direction::forward, control);
}

void write_vertex_field(const std::filesystem::path& path, const VertexField& field, const Control& control,
                        const std::filesystem::path& named) {
  if (has_mesh_suffix(path)) return write_mesh_file(path, mesh_of(field), field.lattice);
  require(field.mesh.is_empty(), "the field is a mesh, which " + (named.empty() ? path : named).string() +
                                     " cannot hold; write it as a mesh, .vtu or .vtk");
  write_field_file(path, field, control);
}

void write_field_file(const std::filesystem::path& path, const PullField& field, const Control& control) {
  write_as(path, field.grid, field.displacement, Direction::pull, control);
}

std::unique_ptr<ImageWriter> create_field_file(const std::filesystem::path& path, const Geometry& grid,
                                               Direction direction) {
  ImageWriteOptions options;
  const std::optional<ImageFormat> format = image_format(path);
  if (format == ImageFormat::nifti) {
    options.metadata["descrip"] = std::string(kDirectionKey) + "=" + to_string(direction);
  } else {
    options.metadata[kDirectionKey] = to_string(direction);
  }
  if (format == ImageFormat::nrrd)
    options.metadata[kSlicerDirectionKey] = direction == Direction::forward ? kSlicerForward : kSlicerPull;
  return create_image(path, grid, VoxelType::f32, 3, options);
}

}  // namespace tetwarp
