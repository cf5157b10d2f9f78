#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "deform/vertex_field.h"

namespace tetwarp {

enum class FieldDirection : std::uint8_t { forward, pull };
std::string to_string(FieldDirection direction);  // "forward", "pull"

/// A displacement field as a file holds it: three float components a sample, LPS mm, relative.
struct FieldFile {
  Geometry grid;
  std::vector<glm::vec3> displacement;      ///< i fastest
  std::optional<FieldDirection> direction;  ///< as the file states it; files of other tools do not say
};

/// What `tetwarp info` tells of a field file without reading its vectors.
struct FieldFileHeader {
  Geometry grid;
  std::optional<FieldDirection> direction;
  std::string frame = "LPS", units = "mm";  ///< as stated or as assumed
  bool absolute = false;                    ///< displacements, not positions
};

/// Whether the file is a volume file (image_file.h) with three components.
bool is_field_file(const std::filesystem::path& path);

/// Reads .mha .nrrd .nii .nii.gz with vectors of three floats or doubles (doubles are rounded to float).
/// Direction: NRRD and MHA key `tetwarp_direction`, NIfTI descrip `tetwarp_direction=forward`.
/// A pull field may have NaN where there is no source, which a file that does not say its direction has only for
/// `read_pull_field`.
/// @throws InputError for a file that is no field, or with a value that is not finite (the first such vertex is named)
FieldFileHeader read_field_header(const std::filesystem::path& path);
FieldFile read_field_file(const std::filesystem::path& path);

/// As `read_field_file`, and the direction must not be stated otherwise.
/// @throws InputError naming the file and both directions
VertexField read_forward_field(const std::filesystem::path& path);
PullField read_pull_field(const std::filesystem::path& path);

/// Writes the field with its direction. The same bits come back from `read_forward_field`.
void write_field_file(const std::filesystem::path& path, const VertexField& field);
void write_field_file(const std::filesystem::path& path, const PullField& field);

}  // namespace tetwarp
