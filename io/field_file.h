// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <concepts>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "deform/vertex_field.h"
#include "io/image_file.h"

namespace tetwarp {

/// The word "forward" or "pull".
std::string to_string(Direction direction);

/// A displacement field, whatever conventions its file has: displacements, not positions, in LPS mm.
struct FieldFile {
  Geometry grid;                        ///< grid of the samples
  std::vector<glm::vec3> displacement;  ///< one for each sample, LPS mm, i fastest
  std::optional<Direction> direction;   ///< as the file states it; empty for most files of other tools
};

/// How a property of a field is known.
enum class FieldBasis : std::uint8_t {
  stated,     ///< this file states it
  by_format,  ///< it is the same in every file of this format
  by_option,  ///< an option of the `FieldSource` states it
  assumed     ///< nothing states it
};
/// The words "stated", "by the format", "by an option" or "assumed".
std::string to_string(FieldBasis basis);

/// What `tetwarp info` shows of a field file without reading its vectors. It describes the file, not the `FieldFile`
/// that is read from it.
struct FieldFileHeader {
  Geometry grid;  ///< grid of the samples
  /// Whether the file has a grid. A file that states only a size is taken to lie on `FieldSource::grid`; without that,
  /// only the size of `grid` is known.
  bool has_own_grid = true;
  std::string format;                                ///< such as "NIfTI, intent 1006 (DISPVECT)"
  std::optional<Direction> direction;                ///< empty: not known
  std::string frame = "LPS";                         ///< axes of the vectors: LPS, RAS, or index for the grid's i, j, k
  std::string units = "mm";                          ///< unit of the vectors: mm or voxel
  bool absolute = false;                             ///< whether the vectors are positions, not displacements
  std::vector<std::string> notes = {};               ///< remarks for people, without the name of the file
  FieldBasis direction_basis = FieldBasis::assumed,  ///< how `direction` is known
      frame_basis = FieldBasis::assumed,             ///< how `frame` is known
      units_basis = FieldBasis::assumed,             ///< how `units` is known
      absolute_basis = FieldBasis::assumed;          ///< how `absolute` is known
};

/// A field file, with everything that has to be said of it because the file does not.
struct FieldSource {
  /// A file that needs no options; not explicit, because most files need none.
  template <std::convertible_to<std::filesystem::path> Path>
  FieldSource(Path&& file) : path(std::forward<Path>(file)) {}  // NOLINT

  std::filesystem::path path;  ///< the file
  /// Key and value, such as "order" and "zyx"; docs/reference/fields.md lists them by format.
  std::map<std::string, std::string> options;
  std::optional<Geometry> grid;                ///< grid of the volume for which the field is meant
  NiftiFrame nifti_frame = NiftiFrame::sform;  ///< which place of a NIfTI file counts

  /// The value of an option, or `otherwise` if it was not given.
  std::string option(const std::string& key, const std::string& otherwise = "") const;
};

/// Options that name a further file: a second mesh, a table of displacements, the two images of a transform of FSL.
inline constexpr std::array<const char*, 4> kFileOptions = {"deformed", "table", "source", "reference"};

/// Parses `PATH` or `PATH:KEY=VALUE[,KEY=VALUE]`. If a file has the whole text as its name, that file is meant.
/// @throws InputError for an option without a value, or given twice
FieldSource parse_field_source(const std::string& text);

/// Checks the options of a source against the format of its file.
/// @throws InputError for options that the format does not have, needs and lacks, or with an unknown value
void check_field_options(const FieldSource& source);

/// Whether some field format reads the file, and it contains vectors, not a volume.
bool is_field_file(const FieldSource& source);

/// Reads what a field file states before its vectors.
/// @throws InputError for a file that is no field
FieldFileHeader read_field_header(const FieldSource& source);
/// Reads a field file of any format; docs/reference/fields.md lists them. Doubles are rounded to float.
/// The direction is stated by the key `tetwarp_direction` of NRRD and MHA, by the NIfTI header field descrip, as in
/// `tetwarp_direction=forward`, by 3D Slicer's key "displacement field type" of NRRD, or as the format has it. Pull
/// fields may have NaN where there is no source; if the file does not state its direction only `read_pull_field` reads
/// such a file.
/// @throws InputError for a file that is no field, or with a value that is not finite (the first such sample is named)
FieldFile read_field_file(const FieldSource& source);

/// Reads a field file as a forward field, as `read_field_file` does.
/// @throws InputError, which names the file, also where the file states that it is a pull field
VertexField read_forward_field(const FieldSource& source);
/// Reads a field file as a pull field, as `read_field_file` does.
/// @throws InputError, which names the file, also where the file states that it is a forward field
PullField read_pull_field(const FieldSource& source);

/// Writes the lattice of a forward field, with its direction. `read_forward_field` gives the same bits again. A mesh is
/// not written.
/// @throws InputError for a suffix that no volume file has, or displacements that do not fit the lattice
/// @throws Error when the file cannot be written
/// @throws Cancelled when `control.stop` is set before the last slice is written
void write_field_file(const std::filesystem::path& path, const VertexField& field, const Control& control = {});
/// Writes a forward field as the suffix of the file has it: .vtu and .vtk get its tetrahedra (io/mesh_writer.h), other
/// files its lattice (`write_field_file`).
/// @param path     the file
/// @param field    what is written
/// @param control  progress and stop
/// @param named    the name that messages give the file; empty: `path`
/// @throws InputError for a mesh in a file that holds a lattice alone; otherwise as those two
void write_vertex_field(const std::filesystem::path& path, const VertexField& field, const Control& control = {},
                        const std::filesystem::path& named = {});
/// Writes a pull field with its direction. `read_pull_field` gives the same bits again.
/// @throws InputError for a suffix that no volume file has, or displacements that do not fit the grid
/// @throws Error when the file cannot be written
/// @throws Cancelled when `control.stop` is set before the last slice is written
void write_field_file(const std::filesystem::path& path, const PullField& field, const Control& control = {});

/// Begins a file as `write_field_file` writes it, for displacements that come slice by slice (3 x float32, LPS mm).
/// @throws InputError for a suffix that no volume file has
/// @throws Error when the file cannot be written
std::unique_ptr<ImageWriter> create_field_file(const std::filesystem::path& path, const Geometry& grid,
                                               Direction direction);

}  // namespace tetwarp
