// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "deform/fields/point_map.h"
#include "io/field_file.h"

namespace tetwarp {

/// A transform that another tool wrote, as a map of points.
struct TransformFile {
  std::string tool;  ///< "ITK", "elastix", "plastimatch", "NiftyReg", "FreeSurfer", "DICOM", ...
  /// ITK: names of the classes, the last applied first; other tools: kind of transform.
  std::vector<std::string> classes;
  std::uint64_t parameters = 0;  ///< number of parameters of all classes
  /// As all transforms of the tool have it; empty: its files do not say, or it was inverted.
  std::optional<Direction> direction;
  std::string frame = "LPS";                 ///< axes of the numbers in the file: LPS, RAS, index or FSL
  FieldBasis basis = FieldBasis::by_format;  ///< how direction and frame are known
  bool affine = false;                       ///< whether T is affine; then it has an inverse
  bool inverted = false;                     ///< whether the option `invert` gave the inverse of the file's transform
  PointMap displacement;  ///< T(x) - x, LPS mm, of a point x; throws InputError where that is not finite
  std::string beyond;     ///< what happens to points outside the domain, for people
  /// How often `displacement` was called for a point outside the domain of a B-spline or displacement field.
  std::shared_ptr<std::atomic<std::uint64_t>> outside;
};

/// Whether a file is a transform: by its name (.h5, .hdf5, .tfm, .txt, .mat, .toml, .lta) or by its header (a cubic
/// B-spline of NiftyReg in NIfTI, a Spatial Registration of DICOM).
bool is_transform_file(const std::filesystem::path& path);

/// Checks the options of a transform file against its format; docs/reference/fields.md lists them.
/// @throws InputError for options that the format does not have, needs and lacks, or with an unknown value
void check_transform_options(const FieldSource& source);

/// Reads a transform; docs/reference/fields.md lists the formats. It may be affine, a B-spline of order 3, a
/// displacement field, or a composite of these. The option `invert=yes` gives the inverse of an affine one. ITK
/// evaluates its own transforms and those of elastix and plastimatch.
///
/// HDF5 is read by the program tetwarp-read in libexec/tetwarp of the installation, so that a damaged file brings down
/// that program alone. The environment variable TETWARP_READ_PROGRAM names another program.
/// @param source  the file; with the options `source` and `reference` also the images whose grids they name
/// @param stop    ends the reading of HDF5, which may take long
/// @throws InputError, which names the file, for one that is no such transform
/// @throws NotCompiled in a build without ITK, for what ITK evaluates
/// @throws Error where tetwarp-read is needed and missing
/// @throws Cancelled
TransformFile read_transform_file(const FieldSource& source, const std::stop_token& stop = {});

/// The files that `read_transform_file` reads: the file itself and those that it or its options name, such as the
/// initial transforms of an elastix parameter file. Their content is not checked.
/// @throws InputError for a file that is missing
/// @throws NotCompiled where the module with ITK is not installed
std::vector<std::filesystem::path> files_of_transform(const FieldSource& source);

}  // namespace tetwarp
