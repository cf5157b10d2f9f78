// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/map_writer.h"

#include <algorithm>
#include <limits>

#include "deform/cpu/rows/inverse_row.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

namespace {

/// Where a row of a map begins in memory.
template <class V>
V* row_of(const VolumeView& map, const glm::i64vec3& voxel) {
  return reinterpret_cast<V*>(map.voxels) + buffer_index(map, voxel) * static_cast<std::size_t>(map.components);
}

}  // namespace

MapWriter::MapWriter(const Maps& maps, const Geometry& output, const Region& region)
    : maps_(maps), mm_from_index_(point_from_index(output).linear) {
  check_maps(maps, output, region);
  for (const VolumeView& map : {maps.coverage, maps.inverse_mm, maps.jacobian, maps.owners, maps.tetrahedra})
    require_host(map.memory, "a map");
}

void MapWriter::write(const Row& row, const std::uint8_t* coverage, const OwnerRow& of_owners) const {
  constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  if (maps_.coverage.voxels) std::copy_n(coverage, row.count, row_of<std::uint8_t>(maps_.coverage, row.voxel));
  if (maps_.inverse_mm.voxels) {
    auto* out = reinterpret_cast<glm::vec3*>(row_of<float>(maps_.inverse_mm, row.voxel));
    write_inverse_row(mm_from_index_, row, out);
  }
  if (wants_jacobian()) {
    float* out = row_of<float>(maps_.jacobian, row.voxel);
    for (int i = 0; i < row.count; ++i) out[i] = row.mapped[i] ? of_owners.jacobian[i] : kNothing;
  }
  if (wants_owners()) std::copy_n(of_owners.owners, row.count, row_of<std::uint16_t>(maps_.owners, row.voxel));
  if (wants_tetrahedra())
    std::copy_n(of_owners.tetrahedra, row.count, row_of<std::uint32_t>(maps_.tetrahedra, row.voxel));
}

std::uint64_t count_of_several(std::span<const std::uint16_t> owners) {
  return static_cast<std::uint64_t>(std::ranges::count_if(owners, [](std::uint16_t number) { return number > 1; }));
}

}  // namespace tetwarp::cpu
