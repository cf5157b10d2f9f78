// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/map_outputs.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "io/field_file.h"
#include "io/image_file.h"
#include "io/lower_case.h"

namespace tetwarp::apps {

void require_image_suffix(const std::filesystem::path& path, const char* option) {
  if (path.empty() || has_image_suffix(path)) return;
  throw UsageError(std::string("unknown suffix of ") + option + " \"" + path.string() +
                   "\"; use .nii .nii.gz .nrrd .mha");
}

bool has_registration_suffix(const std::filesystem::path& path) { return lower(path.extension().string()) == ".dcm"; }

MapOutputs::MapOutputs(const MapOptions& options, Direction direction, bool series, OutputSet& outputs)
    : options_(options) {
  require_image_suffix(options.coverage, "--coverage");
  if (!has_registration_suffix(options.inverse)) {
    require_image_suffix(options.inverse, "--inverse");
  } else if (!series) {
    throw UsageError("--inverse " + options.inverse.string() +
                     " is a DICOM registration between INPUT and a derived DICOM series; name OUTPUT as a folder, or "
                     "the inverse .nii .nii.gz .nrrd .mha");
  }
  require_image_suffix(options.jacobian, "--jacobian");
  require_image_suffix(options.folds, "--folds");
  if (direction == Direction::pull && (!options.jacobian.empty() || !options.folds.empty())) {
    throw UsageError("--jacobian and --folds are of the tetrahedra of a forward field, which --pull-field has not");
  }
  staged_.coverage = outputs.add(options.coverage);
  staged_.inverse = outputs.add(options.inverse);
  staged_.jacobian = outputs.add(options.jacobian);
  staged_.folds = outputs.add(options.folds);
}

std::uint64_t MapOutputs::bytes(const Geometry& grid, bool mass) const {
  const auto held = [&](VolumeView Maps::*map, const std::filesystem::path& path, bool needed = false) {
    return path.empty() && !needed ? 0 : MapStream::bytes(grid, map, !path.empty());
  };
  return held(&Maps::coverage, staged_.coverage, mass) + held(&Maps::jacobian, staged_.jacobian, mass) +
         held(&Maps::owners, staged_.folds) + held(&Maps::inverse_mm, staged_.inverse);
}

void MapOutputs::check(const Geometry& grid) const {
  if (has_registration_suffix(options_.inverse)) require_registration_fits(grid);
}

void MapOutputs::add_to(MapStream& stream, const Geometry& grid, bool mass, const DerivedSeriesWriter* series) const {
  const auto add = [&](VolumeView Maps::*map, const std::filesystem::path& path, VoxelType type, bool needed = false) {
    if (!path.empty() || needed) stream.add(map, path.empty() ? nullptr : create_image(path, grid, type));
  };
  add(&Maps::coverage, staged_.coverage, VoxelType::u8, mass);
  add(&Maps::jacobian, staged_.jacobian, VoxelType::f32, mass);
  add(&Maps::owners, staged_.folds, VoxelType::u16);
  if (staged_.inverse.empty()) return;
  stream.add(&Maps::inverse_mm, has_registration_suffix(options_.inverse)
                                    ? series->create_registration(staged_.inverse)
                                    : create_field_file(staged_.inverse, grid, Direction::pull));
}

nlohmann::json MapOutputs::describe() const {
  nlohmann::json names = nlohmann::json::object();
  const auto add = [&](const char* name, const std::filesystem::path& path) {
    if (!path.empty()) names[name] = path.string();
  };
  add("coverage", options_.coverage);
  add("inverse", options_.inverse);
  add("jacobian", options_.jacobian);
  add("folds", options_.folds);
  return names;
}

}  // namespace tetwarp::apps
