#include "io/field_file.h"

#include <cmath>
#include <utility>

#include "deform/errors.h"
#include "io/image_reader.h"
#include "io/text_header.h"

namespace tetwarp {
namespace {

constexpr const char* kKey = "tetwarp_direction";

/// Vectors whose frame is not the grid's LPS would be turned silently. NRRD is the format that can say so.
void require_lps_vectors(const std::filesystem::path& path) {
  if (image_format(path) != ImageFormat::nrrd) return;
  const TextHeader text = read_text_header(path, ImageFormat::nrrd);
  const std::string space = text["space"];
  require(space.empty() || space == "left-posterior-superior" || space == "LPS" || space == "lps",
          "vectors in the space \"" + space + "\", " + path.string() + "; expected left-posterior-superior");
  std::string frame = text["measurement frame"];
  std::erase(frame, ' ');
  require(frame.empty() || frame == "(1,0,0)(0,1,0)(0,0,1)" || frame == "none(1,0,0)(0,1,0)(0,0,1)",
          "vectors in the measurement frame " + frame + ", " + path.string() + "; expected the identity");
}

std::optional<FieldDirection> stated_direction(const ImageHeader& header, const std::string& file) {
  std::string text;
  if (const auto key = header.metadata.find(kKey); key != header.metadata.end()) text = key->second;
  const std::string prefix = std::string(kKey) + "=";
  if (const auto note = header.metadata.find("descrip");
      note != header.metadata.end() && note->second.starts_with(prefix)) {
    text = note->second.substr(prefix.size());
  }
  if (text.empty()) return std::nullopt;
  if (text == "forward") return FieldDirection::forward;
  require(text == "pull", "the direction \"" + text + "\" (" + kKey + "), " + file + "; expected forward or pull");
  return FieldDirection::pull;
}

std::unique_ptr<ImageReader> open_field(const std::filesystem::path& path) {
  auto reader = open_image(path);
  const ImageHeader& header = reader->header();
  require(header.components == 3 && (header.type == VoxelType::f32 || header.type == VoxelType::f64),
          "not a displacement field, " + path.string() + ": " + std::to_string(header.components) + " x " +
              to_string(header.type) + " a voxel; expected 3 x float32 or float64");
  require_lps_vectors(path);
  return reader;
}

/// @param gaps  whether a displacement may be NaN
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

FieldFile read_as(const std::filesystem::path& path, std::optional<FieldDirection> wanted) {
  const std::string file = path.string();
  const auto reader = open_field(path);
  const ImageHeader& header = reader->header();
  FieldFile field{header.geometry, {}, stated_direction(header, file)};
  require(!wanted || !field.direction || *wanted == *field.direction,
          "a " + (field.direction ? to_string(*field.direction) : "") + " field where a " +
              (wanted ? to_string(*wanted) : "") + " field is expected, " + file + "; " +
              (wanted == FieldDirection::forward ? "give it with --pull-field, or invert it" : "give it with -f"));
  field.displacement.resize(static_cast<std::size_t>(voxel_count(field.grid)));
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
  if (header.type == VoxelType::f32) {
    reader->read(std::as_writable_bytes(std::span(field.displacement)));
  } else {
    std::vector<double> values(reader->value_count());
    reader->read(std::as_writable_bytes(std::span(values)));
    for (std::size_t v = 0; v < field.displacement.size(); ++v) {
      field.displacement[v] = glm::vec3(glm::dvec3(values[3 * v], values[3 * v + 1], values[3 * v + 2]));
    }
  }
  require_finite(field.displacement, field.grid,
                 wanted.value_or(field.direction.value_or(FieldDirection::forward)) == FieldDirection::pull, file);
  return field;
}

void write_as(const std::filesystem::path& path, const Geometry& grid, const std::vector<glm::vec3>& displacement,
              FieldDirection direction) {
  require(displacement.size() == static_cast<std::size_t>(voxel_count(grid)),
          std::to_string(displacement.size()) + " displacements for " + to_string(grid.size) + " vertices, " +
              path.string());
  ImageWriteOptions options;
  if (image_format(path) == ImageFormat::nifti)
    options.metadata["descrip"] = std::string(kKey) + "=" + to_string(direction);
  else
    options.metadata[kKey] = to_string(direction);
  write_image(path, {&grid, whole(grid), VoxelType::f32, 3, std::as_bytes(std::span(displacement)).data()}, options);
}

}  // namespace

std::string to_string(FieldDirection direction) { return direction == FieldDirection::forward ? "forward" : "pull"; }

bool is_field_file(const std::filesystem::path& path) {
  return has_image_suffix(path) && read_image_header(path).components == 3;
}

FieldFileHeader read_field_header(const std::filesystem::path& path) {
  const auto reader = open_field(path);
  FieldFileHeader header;
  header.grid = reader->header().geometry;
  header.direction = stated_direction(reader->header(), path.string());
  return header;
}

FieldFile read_field_file(const std::filesystem::path& path) { return read_as(path, std::nullopt); }

VertexField read_forward_field(const std::filesystem::path& path) {
  FieldFile field = read_as(path, FieldDirection::forward);
  return {field.grid, std::move(field.displacement)};
}

PullField read_pull_field(const std::filesystem::path& path) {
  FieldFile field = read_as(path, FieldDirection::pull);
  return {field.grid, std::move(field.displacement)};
}

void write_field_file(const std::filesystem::path& path, const VertexField& field) {
  write_as(path, field.lattice, field.displacement, FieldDirection::forward);
}

void write_field_file(const std::filesystem::path& path, const PullField& field) {
  write_as(path, field.grid, field.displacement, FieldDirection::pull);
}

}  // namespace tetwarp
