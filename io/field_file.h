// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "deform/vertex_field.h"
#include "io/image_file.h"

namespace tetwarp {

enum class FieldDirection : std::uint8_t { forward, pull };
std::string to_string(FieldDirection direction);  // "forward", "pull"

/// A displacement field, whatever its file has: three float components a sample, LPS mm, relative.
struct FieldFile {
  Geometry grid;
  std::vector<glm::vec3> displacement;      ///< i fastest
  std::optional<FieldDirection> direction;  ///< as the file states it; files of other tools do not say
};

/// How a property of a field is known.
enum class FieldBasis : std::uint8_t {
  stated,     ///< this file says so
  by_format,  ///< every file of its kind has it so
  by_option,  ///< whoever gave the file said so
  assumed     ///< nobody said so
};
std::string to_string(FieldBasis basis);  // "stated", "by the format", "by an option", "assumed"

/// What `tetwarp info` tells of a field file without reading its vectors: how they are in the file, not in FieldFile.
struct FieldFileHeader {
  Geometry grid;
  /// False: the file has no grid but only a size, and takes the place of `FieldSource::grid`; without that, `grid` has
  /// a size and nothing else.
  bool has_own_grid = true;
  std::string format;                       ///< "NIfTI, intent 1006 (DISPVECT)"
  std::optional<FieldDirection> direction;  ///< empty: nobody says
  std::string frame = "LPS";                ///< LPS, RAS, or index: along the grid's i, j, k
  std::string units = "mm";                 ///< mm or voxel
  bool absolute = false;                    ///< displacements, not positions
  std::vector<std::string> notes = {};      ///< for people, without the file's name
  FieldBasis direction_basis = FieldBasis::assumed, frame_basis = FieldBasis::assumed,
             units_basis = FieldBasis::assumed, absolute_basis = FieldBasis::assumed;
};

/// A field file, and what has to be said of files that do not say it themselves.
struct FieldSource {
  FieldSource(std::filesystem::path file) : path(std::move(file)) {}  // NOLINT: most files need nothing else

  std::filesystem::path path;
  std::map<std::string, std::string> options;  ///< docs/reference/fields.md lists them by format: "order" is "zyx"
  std::optional<Geometry> grid;                ///< of the volume that the field is for
  NiftiFrame nifti_frame = NiftiFrame::sform;

  /// The value of an option, or another where it was not given.
  std::string option(const std::string& key, const std::string& otherwise = "") const;
};

/// `PATH` or `PATH:KEY=VALUE[,KEY=VALUE]`; a file whose name is the whole text goes before.
/// @throws InputError for an option without a value, or given twice
FieldSource parse_field_source(const std::string& text);

/// @throws InputError for options that the file's format has not, needs and does not have, or with an unknown value
void check_field_options(const FieldSource& source);

/// Whether a format of io/fields/field_format.h takes the file, and it holds vectors (not a volume).
bool is_field_file(const FieldSource& source);

/// Reads a file of any format of io/fields/field_format.h (docs/reference/fields.md lists them); doubles are rounded to
/// float. Direction: NRRD and MHA key `tetwarp_direction`, NIfTI descrip `tetwarp_direction=forward`, or the format's
/// own. A pull field may have NaN where there is no source, which a file that does not say its direction has only for
/// `read_pull_field`.
/// @throws InputError for a file that is no field, or with a value that is not finite (the first such vertex is named)
FieldFileHeader read_field_header(const FieldSource& source);
FieldFile read_field_file(const FieldSource& source);

/// As `read_field_file`, and the direction must not be stated otherwise.
/// @throws InputError naming the file and both directions
VertexField read_forward_field(const FieldSource& source);
PullField read_pull_field(const FieldSource& source);

/// Writes the field with its direction. The same bits come back from `read_forward_field`.
void write_field_file(const std::filesystem::path& path, const VertexField& field);
void write_field_file(const std::filesystem::path& path, const PullField& field);

/// Begins the same file, for displacements that come slice by slice: 3 x float32, LPS mm.
std::unique_ptr<ImageWriter> create_field_file(const std::filesystem::path& path, const Geometry& grid,
                                               FieldDirection direction);

}  // namespace tetwarp
