#include "deform/cpu/map_writer.h"

#include <algorithm>
#include <limits>

namespace tetwarp::cpu {

namespace {

void check_map(const VolumeView& map, const std::string& name, VoxelType type, int components, const Geometry& output,
               const Region& region) {
  if (!map.voxels) return;
  require(map.geometry && *map.geometry == output, "the " + name + " map is not on the resampler's grid");
  require(map.type == type && map.components == components,
          "the " + name + " map holds " + std::to_string(map.components) + " x " + to_string(map.type) + ", expected " +
              std::to_string(components) + " x " + to_string(type));
  require(contains(map.buffered, region), "the " + name + " map does not buffer the region asked for");
}

/// Where a row of the map begins.
template <class V>
V* row_of(const VolumeView& map, const glm::i64vec3& voxel) {
  const glm::i64vec3 at = voxel - map.buffered.begin, size = map.buffered.end - map.buffered.begin;
  return reinterpret_cast<V*>(map.voxels) + ((at.z * size.y + at.y) * size.x + at.x) * map.components;
}

}  // namespace

MapWriter::MapWriter(const Maps& maps, const Geometry& output, const Region& region)
    : maps_(maps), mm_from_index_(point_from_index(output).linear) {
  check_map(maps.coverage, "coverage", VoxelType::u8, 1, output, region);
  check_map(maps.inverse_mm, "inverse", VoxelType::f32, 3, output, region);
  check_map(maps.jacobian, "jacobian", VoxelType::f32, 1, output, region);
  check_map(maps.owners, "owners", VoxelType::u16, 1, output, region);
}

void MapWriter::write(const Row& row, const std::uint8_t* coverage, const float* jacobian,
                      const std::uint16_t* owners) const {
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  if (maps_.coverage.voxels) std::copy_n(coverage, row.count, row_of<std::uint8_t>(maps_.coverage, row.voxel));
  if (maps_.inverse_mm.voxels) {
    auto* out = reinterpret_cast<glm::vec3*>(row_of<float>(maps_.inverse_mm, row.voxel));
    for (int i = 0; i < row.count; ++i) {
      out[i] = row.mapped[i] ? glm::vec3(mm_from_index_ * glm::dvec3(row.offset[i])) : glm::vec3(kNothing);
    }
  }
  if (wants_jacobian()) {
    float* out = row_of<float>(maps_.jacobian, row.voxel);
    for (int i = 0; i < row.count; ++i) out[i] = row.mapped[i] ? jacobian[i] : kNothing;
  }
  if (wants_owners()) std::copy_n(owners, row.count, row_of<std::uint16_t>(maps_.owners, row.voxel));
}

}  // namespace tetwarp::cpu
