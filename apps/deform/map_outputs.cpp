// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/map_outputs.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <nlohmann/json.hpp>

#include "io/field_file.h"
#include "io/image_file.h"
#include "io/lower_case.h"

namespace tetwarp::apps {

namespace {

/// A map that options can ask for.
struct MapKind {
  const char* name;  ///< name of the option, and key of sidecars
  MapPlace place;
  std::filesystem::path MapOptions::*file;
};
/// All maps, in the order in which they are begun.
constexpr std::array<MapKind, 4> kKinds = {{{"coverage", &Maps::coverage, &MapOptions::coverage},
                                            {"jacobian", &Maps::jacobian, &MapOptions::jacobian},
                                            {"folds", &Maps::owners, &MapOptions::folds},
                                            {"inverse", &Maps::inverse_mm, &MapOptions::inverse}}};

std::unique_ptr<ImageWriter> create_map(const WantedMap& map, const Geometry& grid, const DerivedSeriesWriter* series) {
  if (map.file.empty()) return nullptr;
  if (map.place == &Maps::coverage) return create_image(map.file, grid, VoxelType::u8);
  if (map.place == &Maps::owners) return create_image(map.file, grid, VoxelType::u16);
  if (map.place == &Maps::jacobian) return create_image(map.file, grid, VoxelType::f32);
  return has_registration_suffix(map.file) ? series->create_registration(map.file)
                                           : create_field_file(map.file, grid, Direction::pull);
}

}  // namespace

void require_image_suffix(const std::filesystem::path& path, const char* option) {
  if (path.empty() || has_image_suffix(path)) return;
  throw UsageError(std::string("unknown suffix of ") + option + " \"" + path.string() +
                   "\"; use .nii .nii.gz .nrrd .mha");
}

bool has_registration_suffix(const std::filesystem::path& path) { return lower(path.extension().string()) == ".dcm"; }

std::vector<WantedMap> wanted_maps(const MapOptions& files, std::span<const MapPlace> needed) {
  std::vector<WantedMap> maps;
  for (const MapKind& kind : kKinds) {
    const std::filesystem::path& file = files.*kind.file;
    if (!file.empty() || std::ranges::find(needed, kind.place) != needed.end()) maps.push_back({kind.place, file});
  }
  return maps;
}

void check_maps(const MapOptions& files, bool pulls, bool series) {
  require_image_suffix(files.coverage, "--coverage");
  if (!has_registration_suffix(files.inverse)) {
    require_image_suffix(files.inverse, "--inverse");
  } else if (!series) {
    throw UsageError("--inverse " + files.inverse.string() +
                     " is a DICOM registration between INPUT and a derived DICOM series; name OUTPUT as a folder, or "
                     "the inverse .nii .nii.gz .nrrd .mha");
  }
  require_image_suffix(files.jacobian, "--jacobian");
  require_image_suffix(files.folds, "--folds");
  if (pulls && (!files.jacobian.empty() || !files.folds.empty())) {
    throw UsageError("--jacobian and --folds are of the tetrahedra of a forward field, which --pull-field has not");
  }
}

std::uint64_t map_bytes(const std::vector<WantedMap>& maps, const Geometry& grid) {
  std::uint64_t bytes = 0;
  for (const WantedMap& map : maps) bytes += MapStream::bytes(grid, map.place, !map.file.empty());
  return bytes;
}

void add_maps(const std::vector<WantedMap>& maps, const Geometry& grid, const DerivedSeriesWriter* series,
              MapStream& stream) {
  for (const WantedMap& map : maps) stream.add(map.place, create_map(map, grid, series));
}

nlohmann::json maps_json(const MapOptions& files) {
  nlohmann::json names = nlohmann::json::object();
  for (const MapKind& kind : kKinds) {
    if (!(files.*kind.file).empty()) names[kind.name] = (files.*kind.file).string();
  }
  return names;
}

}  // namespace tetwarp::apps
