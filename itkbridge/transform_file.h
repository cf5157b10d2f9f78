// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <glm/vec3.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

/// The program that wrote a transform file.
enum class TransformTool : std::uint8_t { itk, elastix, plastimatch };

/// A transform as a file holds it. Several parts are composed in ITK's order: the last one is applied first.
struct StoredTransform {
  TransformTool tool = TransformTool::itk;
  std::vector<TransformRecord> parts;
};

/// Reads an ITK transform file (HDF5, or the text of .tfm and .txt), an elastix parameter file with its initial
/// transforms, or a B-spline of plastimatch. The content decides, not the name.
///
/// ITK's own reader is not used: it allocates what a B-spline's grid promises before it looks at the parameters, reads
/// past the end of too few of them, and stops silently at what is not a number.
/// @param stop  ends the reading of HDF5, which may take long
/// @throws InputError naming the file; Cancelled
StoredTransform read_transform(const std::filesystem::path& path, const std::stop_token& stop = {});

/// Maps a point to T(point), both LPS mm. Several threads may call it at a time. `outside` becomes true where a
/// B-spline or displacement field on the way has no value at the point; that part then leaves the point where it is, as
/// ITK does.
using TransformFunction = std::function<glm::dvec3(const glm::dvec3& point, bool& outside)>;

/// Makes a function that evaluates the transform by ITK: affine transforms of all kinds, B-splines of order 3,
/// displacement fields.
/// @param file  its name, for messages
/// @throws InputError for an unknown class, other than 3 dimensions, a wrong number of parameters, a value that is not
/// finite, or a grid that cannot exist
TransformFunction make_transform(const StoredTransform& stored, const std::string& file);

/// A transform file that was read and can be evaluated.
struct LoadedTransform {
  StoredTransform stored;
  TransformFunction map;
  bool affine = false;  ///< whether it has neither a B-spline nor a displacement field
};

/// Entry point of the module, which io/fields/transform_itk.cpp loads: `read_transform`, then `make_transform`.
extern "C" void tetwarp_load_transform(const std::filesystem::path& path, const std::stop_token& stop,
                                       LoadedTransform& loaded);
/// Entry point of the module: the files that `read_transform` reads, which are the file itself and the initial
/// transforms of elastix. Parameters are not checked.
/// @throws InputError for a file that is missing, or initial transforms that name each other in a circle
extern "C" void tetwarp_transform_files(const std::filesystem::path& path, std::vector<std::filesystem::path>& files);

}  // namespace tetwarp
