#include "apps/map_outputs.h"

#include <nlohmann/json.hpp>

#include "io/field_file.h"
#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

void write_if_wanted(const std::filesystem::path& path, const AnyVolume& map) {
  if (!path.empty()) write_image(path, map.view());
}

}  // namespace

void require_image_suffix(const std::filesystem::path& path, const char* option) {
  if (path.empty() || has_image_suffix(path)) return;
  throw UsageError(std::string("unknown suffix of ") + option + " \"" + path.string() +
                   "\"; use .nii .nii.gz .nrrd .mha");
}

MapOutputs::MapOutputs(const MapOptions& options, Direction direction, OutputSet& outputs) : options_(options) {
  require_image_suffix(options.coverage, "--coverage");
  require_image_suffix(options.inverse, "--inverse");
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

std::uint64_t MapOutputs::bytes_a_voxel() const {
  return (staged_.coverage.empty() ? 0 : sizeof(std::uint8_t)) + (staged_.inverse.empty() ? 0 : sizeof(glm::vec3)) +
         (staged_.jacobian.empty() ? 0 : sizeof(float)) + (staged_.folds.empty() ? 0 : sizeof(std::uint16_t));
}

Maps MapOutputs::make(const Geometry& grid, bool jacobian) {
  Maps maps;
  if (!staged_.coverage.empty()) maps.coverage = (coverage_ = AnyVolume(grid, VoxelType::u8)).view();
  if (jacobian || !staged_.jacobian.empty()) maps.jacobian = (jacobian_ = AnyVolume(grid, VoxelType::f32)).view();
  if (!staged_.folds.empty()) maps.owners = (owners_ = AnyVolume(grid, VoxelType::u16)).view();
  if (!staged_.inverse.empty()) {
    inverse_ = {grid, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(grid)))};
    maps.inverse_mm = samples_of(inverse_);
  }
  return maps;
}

void MapOutputs::write() const {
  write_if_wanted(staged_.coverage, coverage_);
  write_if_wanted(staged_.jacobian, jacobian_);
  write_if_wanted(staged_.folds, owners_);
  if (!staged_.inverse.empty()) write_field_file(staged_.inverse, inverse_);
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
