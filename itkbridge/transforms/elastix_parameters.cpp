// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/transforms/elastix_parameters.h"

#include <algorithm>

#include "deform/errors.h"
#include "itkbridge/transforms/parameter_file.h"

namespace tetwarp {
namespace {

constexpr std::size_t kMostFiles = 100;

/// Size, origin, spacing and direction in the order of ITK's BSplineTransform. elastix counts samples from GridIndex
/// and writes the direction column by column.
std::vector<double> grid_of(const ParameterFile& from) {
  const std::vector<double> size = from.numbers("GridSize", 3), index = from.numbers("GridIndex", 3),
                            spacing = from.numbers("GridSpacing", 3), origin = from.numbers("GridOrigin", 3);
  const std::vector<double> columns =
      from.has("GridDirection") ? from.numbers("GridDirection", 9) : std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::vector<double> grid = size;
  for (std::size_t row = 0; row < 3; ++row) {
    double first = origin[row];
    for (std::size_t axis = 0; axis < 3; ++axis) first += columns[3 * axis + row] * index[axis] * spacing[axis];
    grid.push_back(first);
  }
  grid.insert(grid.end(), spacing.begin(), spacing.end());
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) grid.push_back(columns[3 * axis + row]);
  }
  return grid;
}

TransformRecord record_of(const ParameterFile& from) {
  from.require_word("FixedImageDimension", "3");
  from.require_word("MovingImageDimension", "3");
  from.require_word("UseBinaryFormatForTransformationParameters", "false");
  const std::string name = from.word("Transform", "");
  TransformRecord record{"", {}, from.numbers("TransformParameters")};
  const std::vector<double> count = from.numbers("NumberOfParameters", 1);
  require(count.front() == static_cast<double>(record.parameters.size()),
          std::to_string(record.parameters.size()) + " values of TransformParameters in " + from.file() +
              "; NumberOfParameters says " + from.word("NumberOfParameters", ""));
  if (name == "BSplineTransform" || name == "RecursiveBSplineTransform") {
    from.require_word("BSplineTransformSplineOrder", "3");
    from.require_word("UseCyclicTransform", "false");
    return {"BSplineTransform_double_3_3", grid_of(from), std::move(record.parameters)};
  }
  if (name == "TranslationTransform") return {"TranslationTransform_double_3_3", {}, std::move(record.parameters)};
  require(name == "EulerTransform" || name == "AffineTransform" || name == "SimilarityTransform",
          "the transform \"" + name.substr(0, 60) + "\" of elastix, " + from.file() +
              "; expected EulerTransform, AffineTransform, TranslationTransform, SimilarityTransform or "
              "BSplineTransform");
  record.fixed = from.numbers("CenterOfRotationPoint", 3);
  if (name == "EulerTransform") record.fixed.push_back(from.word("ComputeZYX", "false") == "true" ? 1 : 0);
  record.type =
      (name == "AffineTransform" ? name : name.substr(0, name.find("Transform")) + "3DTransform") + "_double_3_3";
  return record;
}

/// Whether a path is a regular file; false also for a name that no file can have, for which std::filesystem throws.
bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

/// The path of the initial transform; empty if there is none.
std::filesystem::path initial_of(const ParameterFile& from) {
  const std::string old_key = "InitialTransformParametersFileName", key = "InitialTransformParameterFileName";
  const std::string name = from.word(from.has(key) ? key : old_key, "NoInitialTransform");
  if (name == "NoInitialTransform") return {};
  from.require_word("HowToCombineTransforms", "Compose");
  const std::filesystem::path said(name), own(from.file());
  for (const std::filesystem::path& path : {own.parent_path() / said, said}) {
    if (is_file(path)) return path;
  }
  // If both files were moved to another folder, the name alone still fits, unless it is that of this file.
  const std::filesystem::path beside = own.parent_path() / said.filename();
  if (said.filename() != own.filename() && is_file(beside)) return beside;
  throw InputError("the initial transform " + name + " is not there, " + from.file());
}

/// Calls `visit` for a file and then for the initial transform that each file names.
template <class Visit>
void follow(const std::filesystem::path& path, Visit&& visit) {
  std::vector<std::filesystem::path> seen;
  for (std::filesystem::path file = path; !file.empty();) {
    require(std::ranges::find(seen, std::filesystem::canonical(file)) == seen.end() && seen.size() < kMostFiles,
            "the initial transforms of " + path.string() +
                " lead in a circle, or there are too many: " + file.string() + " again");
    seen.push_back(std::filesystem::canonical(file));
    require(is_elastix_file(file), "not an elastix parameter file, " + file.string() + ", named by " + path.string());
    const ParameterFile parameters(file);
    visit(parameters);
    file = initial_of(parameters);
  }
}

}  // namespace

std::vector<TransformRecord> read_elastix(const std::filesystem::path& path) {
  std::vector<TransformRecord> records;
  follow(path, [&](const ParameterFile& parameters) { records.push_back(record_of(parameters)); });
  return records;
}

std::vector<std::filesystem::path> elastix_files(const std::filesystem::path& path) {
  std::vector<std::filesystem::path> files;
  follow(path, [&](const ParameterFile& parameters) { files.emplace_back(parameters.file()); });
  return files;
}

}  // namespace tetwarp
