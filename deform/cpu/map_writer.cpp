// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/map_writer.h"

#include <algorithm>
#include <limits>

#include "deform/cpu/rows/inverse_row.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

/// Where a row of a map begins in memory. @tparam V  all values of a voxel
template <class V>
V* row_of(const VolumeView& map, const glm::i64vec3& voxel) {
  return reinterpret_cast<V*>(map.voxels) + buffer_index(map, voxel);
}

}  // namespace

MapWriter::MapWriter(const Maps& maps, const Geometry& output, const Region& region)
    : maps_(maps), mm_from_index_(point_from_index(output).linear) {
  check_maps(maps, output, region);
  for (const VolumeView& map : {maps.coverage, maps.inverse_mm, maps.jacobian, maps.owners, maps.tetrahedra})
    require_host(map.memory, "a map");
}

void MapWriter::write(const Row& row, const std::uint8_t* coverage, const OwnerRow& of_owners) const {
  if (maps_.coverage.voxels) std::copy_n(coverage, row.count, row_of<std::uint8_t>(maps_.coverage, row.voxel));
  if (maps_.inverse_mm.voxels) write_inverse_row(mm_from_index_, row, row_of<glm::vec3>(maps_.inverse_mm, row.voxel));
  if (wants_jacobian()) {
    float* out = row_of<float>(maps_.jacobian, row.voxel);
    for (int i = 0; i < row.count; ++i) out[i] = row.mapped[i] ? of_owners.jacobian[i] : kNothing;
  }
  if (wants_owners()) write_owners(row.voxel, row.count, of_owners.owners);
  if (wants_tetrahedra())
    std::copy_n(of_owners.tetrahedra, row.count, row_of<std::uint32_t>(maps_.tetrahedra, row.voxel));
}

void MapWriter::write(const VoxelList& list, const std::uint8_t* coverage, const OwnerRow& of_owners) const {
  const auto put = [&]<class V>(const VolumeView& map, const V* values) {
    if (!map.voxels) return;
    V* first = row_of<V>(map, list.first);
    const glm::i64vec3 size = map.buffered.end - map.buffered.begin;
    for (int i = 0; i < list.count; ++i) {
      const glm::i64vec3 in(list.in_tile_at(i));
      first[(in.z * size.y + in.y) * size.x + in.x] = values[i];
    }
  };
  put(maps_.coverage, coverage);
  put(maps_.jacobian, of_owners.jacobian);
  put(maps_.tetrahedra, of_owners.tetrahedra);
  if (!maps_.inverse_mm.voxels) return;
  std::uint8_t mapped[kRoomTogether];
  glm::vec3 inverse[kRoomTogether];
  std::fill_n(mapped, list.count, std::uint8_t{1});
  write_inverse_row(mm_from_index_, {list.first, list.count, mapped, list.offset, list.fixed}, inverse);
  put(maps_.inverse_mm, inverse);
}

void MapWriter::write_owners(const glm::i64vec3& voxel, int count, const std::uint16_t* owners) const {
  std::copy_n(owners, count, row_of<std::uint16_t>(maps_.owners, voxel));
}

void MapWriter::clear(const glm::i64vec3& voxel, int count) const {
  const auto fill = [&]<class V>(const VolumeView& map, const V& value) {
    if (map.voxels) std::fill_n(row_of<V>(map, voxel), count, value);
  };
  fill(maps_.coverage, std::uint8_t{0});
  fill(maps_.inverse_mm, glm::vec3(kNothing));
  fill(maps_.jacobian, kNothing);
  fill(maps_.tetrahedra, kNoTetrahedron);
}

std::uint64_t count_of_several(std::span<const std::uint16_t> owners) {
  return static_cast<std::uint64_t>(std::ranges::count_if(owners, [](std::uint16_t number) { return number > 1; }));
}

}  // namespace tetwarp::cpu
