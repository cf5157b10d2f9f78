// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_image.h"

#include <algorithm>

#include "deform/errors.h"
#include "io/images/text_header.h"

namespace tetwarp {
namespace {

/// Refuses vectors that the file says are in another frame than LPS, for they would be turned silently. NRRD is the
/// only format that can say so.
/// @return whether the file says LPS
bool require_lps_vectors(const std::filesystem::path& path) {
  const TextHeader text = read_text_header(path, ImageFormat::nrrd);
  const std::string space = text["space"];
  require(space.empty() || space == "left-posterior-superior" || space == "LPS" || space == "lps",
          "vectors in the space \"" + space + "\", " + path.string() + "; expected left-posterior-superior");
  std::string frame = text["measurement frame"];
  std::erase(frame, ' ');
  require(frame.empty() || frame == "(1,0,0)(0,1,0)(0,0,1)" || frame == "none(1,0,0)(0,1,0)(0,0,1)",
          "vectors in the measurement frame " + frame + ", " + path.string() + "; expected the identity");
  return !space.empty() && !frame.empty();
}

class ImageFieldReader final : public FieldReader {
 public:
  ImageFieldReader(FieldFileHeader header, std::unique_ptr<ImageReader> image)
      : FieldReader(std::move(header)), image_(std::move(image)) {}
  void read(std::span<glm::vec3> displacement) const override { read_vectors(*image_, displacement); }

 private:
  std::unique_ptr<ImageReader> image_;
};

/// Takes the direction from the key of 3D Slicer, where the file has it.
void read_slicer_direction(const ImageHeader& image, const std::string& file, FieldFileHeader& header) {
  const auto key = image.metadata.find(kSlicerDirectionKey);
  if (key == image.metadata.end()) return;
  require(key->second == kSlicerPull || key->second == kSlicerForward,
          "the direction \"" + key->second + "\" (" + kSlicerDirectionKey + "), " + file + "; expected " + kSlicerPull +
              " or " + kSlicerForward);
  header.direction = key->second == kSlicerForward ? Direction::forward : Direction::pull;
  header.direction_basis = FieldBasis::stated;
}

bool recognizes(const std::filesystem::path& path, std::string_view) { return has_image_suffix(path); }

bool holds_field(const FieldSource& source) { return read_image_header(source.path).components == 3; }

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  auto image = open_vectors(source.path);
  const bool nrrd = image_format(source.path) == ImageFormat::nrrd;
  FieldFileHeader header;
  header.grid = image->header().geometry;
  header.format = nrrd ? "NRRD" : "MHA";
  read_stated_direction(image->header(), source.path.string(), header);
  if (nrrd && require_lps_vectors(source.path)) header.frame_basis = FieldBasis::stated;
  return std::make_unique<ImageFieldReader>(std::move(header), std::move(image));
}

}  // namespace

const FieldFormat kFieldFormat_image = {recognizes, holds_field, nullptr, open};

std::unique_ptr<ImageReader> open_vectors(const std::filesystem::path& path, NiftiFrame frame, NiftiVectors vectors) {
  auto reader = open_image(path, frame, vectors);
  const ImageHeader& header = reader->header();
  require(header.components == 3 && (header.type == VoxelType::f32 || header.type == VoxelType::f64),
          "not a displacement field, " + path.string() + ": " + std::to_string(header.components) + " x " +
              to_string(header.type) + " a voxel; expected 3 x float32 or float64");
  return reader;
}

void read_stated_direction(const ImageHeader& image, const std::string& file, FieldFileHeader& header) {
  std::string text;
  if (const auto key = image.metadata.find(kDirectionKey); key != image.metadata.end()) text = key->second;
  const std::string prefix = std::string(kDirectionKey) + "=";
  if (const auto note = image.metadata.find("descrip");
      note != image.metadata.end() && note->second.starts_with(prefix)) {
    text = note->second.substr(prefix.size());
  }
  read_slicer_direction(image, file, header);
  if (text.empty()) return;
  require(text == "forward" || text == "pull",
          "the direction \"" + text + "\" (" + kDirectionKey + "), " + file + "; expected forward or pull");
  const Direction direction = text == "forward" ? Direction::forward : Direction::pull;
  require(!header.direction || header.direction == direction,
          std::string(kDirectionKey) + " and \"" + kSlicerDirectionKey + "\" contradict each other, " + file +
              "; expected forward and modeling, or pull and resampling");
  header.direction = direction;
  header.direction_basis = FieldBasis::stated;
  header.frame_basis = header.units_basis = header.absolute_basis = FieldBasis::by_format;
}

std::vector<glm::dvec3> read_double_vectors(const ImageReader& reader) {
  static_assert(sizeof(glm::dvec3) == 3 * sizeof(double));
  std::vector<glm::dvec3> vectors(reader.value_count() / 3);
  if (reader.header().type == VoxelType::f64) {
    reader.read(std::as_writable_bytes(std::span(vectors)));
    return vectors;
  }
  std::vector<glm::vec3> floats(vectors.size());
  reader.read(std::as_writable_bytes(std::span(floats)));
  std::copy(floats.begin(), floats.end(), vectors.begin());
  return vectors;
}

void read_vectors(const ImageReader& reader, std::span<glm::vec3> vectors,
                  const std::function<glm::dvec3(const glm::dvec3&, std::size_t)>& to_mm) {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
  if (reader.header().type == VoxelType::f32) {
    reader.read(std::as_writable_bytes(vectors));
    if (!to_mm) return;
    for (std::size_t v = 0; v < vectors.size(); ++v) vectors[v] = glm::vec3(to_mm(glm::dvec3(vectors[v]), v));
    return;
  }
  const std::vector<glm::dvec3> values = read_double_vectors(reader);
  for (std::size_t v = 0; v < vectors.size(); ++v) vectors[v] = glm::vec3(to_mm ? to_mm(values[v], v) : values[v]);
}

}  // namespace tetwarp
