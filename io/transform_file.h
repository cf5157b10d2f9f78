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
  std::string tool;                  ///< "ITK", "elastix", "plastimatch" or "NiftyReg"
  std::vector<std::string> classes;  ///< of ITK, the last applied first; of others what it is
  std::uint64_t parameters = 0;      ///< of all classes
  bool pulls = false;                ///< the tool's transforms map output to input (not ITK's: its files do not say)
  PointMap displacement;             ///< T(x) - x, LPS mm. Throws InputError where that is not finite
  std::string beyond;                ///< what becomes of points outside its domain, for people
  /// How often `displacement` was asked for a point outside the domain of a B-spline or displacement field.
  std::shared_ptr<std::atomic<std::uint64_t>> outside;
};

/// Whether a file is a transform: by its name (.h5 .hdf5 .tfm .txt), or, of a NIfTI file, by its header (a cubic
/// B-spline of NiftyReg).
bool is_transform_file(const std::filesystem::path& path);

/// Reads an ITK transform file (.h5 .tfm .txt), an elastix parameter file or a plastimatch B-spline (.txt): affine
/// transforms of all kinds, B-splines of order 3, displacement fields, and composites of these. ITK evaluates them.
/// Reads a cubic B-spline control point grid of NiftyReg (.nii .nii.gz) as well.
///
/// HDF5 is read by the program tetwarp-read of the installation, so that a damaged file brings down that program alone.
/// It lies in libexec/tetwarp; the environment variable TETWARP_READ_PROGRAM names another.
/// @param stop  ends the reading of HDF5, which may take long
/// @throws InputError naming the file for what is not that; NotCompiled in a build without ITK; Error where
///         tetwarp-read is needed and missing; Cancelled
TransformFile read_transform_file(const std::filesystem::path& path, const std::stop_token& stop = {});

/// The files that `read_transform_file` reads: the one that is named, and those that it names, as a parameter file of
/// elastix its initial transforms. Nothing is said of what they hold.
/// @throws InputError for one that is missing; NotCompiled as above, but for a module alone
std::vector<std::filesystem::path> files_of_transform(const std::filesystem::path& path);

}  // namespace tetwarp
