#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "deform/fields/point_map.h"

namespace tetwarp {

/// A transform that another tool wrote, as a map of points.
struct TransformFile {
  std::string tool;                  ///< "ITK", "elastix" or "plastimatch"
  std::vector<std::string> classes;  ///< of ITK, the last applied first
  std::uint64_t parameters = 0;      ///< of all classes
  bool pulls = false;                ///< the tool's transforms map output to input (not ITK's: its files do not say)
  PointMap displacement;             ///< T(x) - x, LPS mm. Throws InputError where that is not finite
  /// How often `displacement` was asked for a point where a B-spline or displacement field has no value and leaves the
  /// point where it is.
  std::shared_ptr<std::atomic<std::uint64_t>> outside;
};

/// Whether the name ends as those of transform files do: .h5 .hdf5 .tfm .txt.
bool has_transform_suffix(const std::filesystem::path& path);

/// Reads an ITK transform file (.h5 .tfm .txt), an elastix parameter file or a plastimatch B-spline (.txt): affine
/// transforms of all kinds, B-splines of order 3, displacement fields, and composites of these. ITK evaluates them.
/// @throws InputError naming the file for what is not that; NotCompiled in a build without ITK
TransformFile read_transform_file(const std::filesystem::path& path);

}  // namespace tetwarp
