// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <vector>

#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

/// Reads an elastix transform parameter file (TransformParameters.0.txt, or .toml of elastix 5.2 and later) and the
/// initial transforms that it names, as transforms of ITK: EulerTransform, AffineTransform, TranslationTransform,
/// SimilarityTransform, BSplineTransform and RecursiveBSplineTransform of order 3.
///
/// elastix maps output to input: x_moving = T(x_fixed). The result is in ITK's order: its last element, the initial
/// transform that names no further one, is applied first. A file named by InitialTransformParametersFileName is looked
/// for from the folder of the file that names it, then from the working folder, then by its own name beside the file
/// that names it.
/// @throws InputError naming the file: damaged, another transform, HowToCombineTransforms "Add", binary parameters, not
/// 3-D, initial transforms that name each other in a circle
std::vector<TransformRecord> read_elastix(const std::filesystem::path& path);

/// The files that `read_elastix` reads, the given one first. What their transforms are is not checked. @throws
/// InputError naming a file that is missing or damaged, or initial transforms that name each other in a circle
std::vector<std::filesystem::path> elastix_files(const std::filesystem::path& path);

}  // namespace tetwarp
