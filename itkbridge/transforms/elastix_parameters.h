// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <vector>

#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

/// Whether the file is a list of `(Key value ...)`, as elastix writes.
bool is_elastix_file(const std::filesystem::path& path);

/// Reads an elastix transform parameter file (TransformParameters.0.txt) and the initial transforms that it names, as
/// the transforms of ITK that they are: EulerTransform, AffineTransform, TranslationTransform, SimilarityTransform,
/// BSplineTransform and RecursiveBSplineTransform of order 3.
///
/// elastix maps output to input: x_moving = T(x_fixed). The result is in ITK's order: the last, the initial transform
/// of all, is applied first. A file named by InitialTransformParametersFileName is looked for from the folder of the
/// one that names it, then from the working folder, then by its last name beside the one that names it.
/// @throws InputError naming the file: damaged, another transform, HowToCombineTransforms "Add", binary parameters,
///         not 3-D, initial transforms that lead in a circle
std::vector<TransformRecord> read_elastix(const std::filesystem::path& path);

/// The files that `read_elastix` reads, the one that is named first. @throws InputError as that, for the same files,
/// but not for what their transforms are
std::vector<std::filesystem::path> elastix_files(const std::filesystem::path& path);

}  // namespace tetwarp
