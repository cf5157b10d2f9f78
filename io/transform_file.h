// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "deform/fields/point_map.h"

namespace tetwarp {

/// A transform that another tool wrote, as a map of points.
struct TransformFile {
  std::string tool;  ///< "ITK", "elastix", "plastimatch" or "NiftyReg"
  /// ITK: names of the classes, the last applied first; other tools: kind of transform.
  std::vector<std::string> classes;
  std::uint64_t parameters = 0;  ///< number of parameters of all classes
  bool pulls = false;     ///< whether the tool's transforms map output to input; false for ITK, whose files do not say
  PointMap displacement;  ///< T(x) - x, LPS mm, of a point x; throws InputError where that is not finite
  std::string beyond;     ///< for people: what happens to points outside the domain
  /// How often `displacement` was called for a point outside the domain of a B-spline or displacement field.
  std::shared_ptr<std::atomic<std::uint64_t>> outside;
};

/// Whether a file is a transform: by its name (.h5, .hdf5, .tfm, .txt) or, of a NIfTI file, by its header (a cubic
/// B-spline of NiftyReg).
bool is_transform_file(const std::filesystem::path& path);

/// Reads a transform: an ITK transform file (.h5, .tfm, .txt), an elastix parameter file or plastimatch B-spline
/// (.txt), or a grid of control points of a cubic B-spline of NiftyReg (.nii, .nii.gz). It may be affine, a B-spline of
/// order 3, a displacement field, or a composite of these. ITK evaluates all but those of NiftyReg.
///
/// HDF5 is read by the program tetwarp-read in libexec/tetwarp of the installation, so that a damaged file brings down
/// that program alone. The environment variable TETWARP_READ_PROGRAM names another program.
/// @param path  the file
/// @param stop  ends the reading of HDF5, which may take long
/// @throws InputError, which names the file, for one that is no such transform
/// @throws NotCompiled in a build without ITK, for all but those of NiftyReg
/// @throws Error where tetwarp-read is needed and missing
/// @throws Cancelled
TransformFile read_transform_file(const std::filesystem::path& path, const std::stop_token& stop = {});

/// The files that `read_transform_file` reads: the file itself and those that it names, such as the initial transforms
/// of an elastix parameter file. Their content is not checked.
/// @throws InputError for a file that is missing
/// @throws NotCompiled where the module with ITK is not installed
std::vector<std::filesystem::path> files_of_transform(const std::filesystem::path& path);

}  // namespace tetwarp
