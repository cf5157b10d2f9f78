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

/// Who wrote a transform file.
enum class TransformTool : std::uint8_t { itk, elastix, plastimatch };

/// A transform as files hold it. Several parts are composed in ITK's order: the last is applied first.
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

/// T(x), both LPS mm. Called from several threads. `outside` becomes true where a B-spline or displacement field on the
/// way has no value at the point, which it then leaves where it is, as ITK does.
using TransformFunction = std::function<glm::dvec3(const glm::dvec3& point, bool& outside)>;

/// The transform, evaluated by ITK: affine ones of all kinds, B-splines of order 3, displacement fields.
/// @param file  for errors
/// @throws InputError for an unknown class, other than 3 dimensions, a wrong number of parameters, a value that is not
///         finite, a grid that cannot be
TransformFunction make_transform(const StoredTransform& stored, const std::string& file);

/// A file read and made ready.
struct LoadedTransform {
  StoredTransform stored;
  TransformFunction map;
};

/// Entry point of the module, which io/fields/transform_file.cpp loads: `read_transform`, then `make_transform`.
extern "C" void tetwarp_load_transform(const std::filesystem::path& path, const std::stop_token& stop,
                                       LoadedTransform& loaded);
/// Entry point of the module: the files that `read_transform` reads, which are the file itself and the initial
/// transforms of elastix. Parameters are not checked.
/// @throws InputError for a file that is missing, or initial transforms that form a circle
extern "C" void tetwarp_transform_files(const std::filesystem::path& path, std::vector<std::filesystem::path>& files);

}  // namespace tetwarp
