// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/coarse_volume.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace tetwarp::viewer {

glm::i64vec3 coarse_blocks(const Geometry& grid) {
  glm::i64vec3 blocks = (grid.size + (kMostCoarseVoxels - 1)) / kMostCoarseVoxels;
  if (!grid.slices.empty()) blocks.z = 1;
  for (int axis = 0; axis < 3; ++axis)  // at least two voxels are left on an axis
    blocks[axis] = std::min(blocks[axis], std::max<std::int64_t>(grid.size[axis] - 1, 1));
  return blocks;
}

glm::i64vec3 moving_blocks(const Geometry& grid) {
  const bool is_deep = grid.slices.empty() && grid.size.z > kMostMovingVoxels;
  glm::i64vec3 blocks(2, 2, is_deep ? 2 : 1);
  for (int axis = 0; axis < 2; ++axis)  // at least two voxels are left on an axis
    if (grid.size[axis] < 4) blocks[axis] = 1;
  return blocks;
}

Geometry coarse_grid(const Geometry& grid, const glm::i64vec3& blocks) {
  Geometry coarse = grid;
  coarse.size = (grid.size + blocks - std::int64_t{1}) / blocks;
  coarse.spacing = grid.spacing * glm::dvec3(blocks);
  coarse.origin = point_from_index(grid)(0.5 * glm::dvec3(blocks - std::int64_t{1}));
  return coarse;
}

namespace {

/// The mean of a block.
template <class V>
V mean(const V* voxels, const glm::i64vec3& size, const glm::i64vec3& begin, const glm::i64vec3& end) {
  double sum = 0;
  for (std::int64_t k = begin.z; k < end.z; ++k) {
    for (std::int64_t j = begin.y; j < end.y; ++j) {
      const V* const row = voxels + (k * size.y + j) * size.x;
      for (std::int64_t i = begin.x; i < end.x; ++i) sum += static_cast<double>(row[i]);
    }
  }
  const glm::i64vec3 side = end - begin;
  const double value = sum / static_cast<double>(side.x * side.y * side.z);
  return static_cast<V>(std::is_integral_v<V> ? std::floor(value + 0.5) : value);
}

}  // namespace

AnyVolume coarse_volume(const ConstVolumeView& volume, const glm::i64vec3& blocks) {
  const glm::i64vec3 size = volume.geometry->size;
  AnyVolume coarse(coarse_grid(*volume.geometry, blocks), volume.type);
  const glm::i64vec3 count = coarse.geometry().size;
  dispatch(volume.type, [&](auto zero) {
    using V = decltype(zero);
    const auto* const from = reinterpret_cast<const V*>(volume.voxels);
    const std::span<V> to = coarse.as<V>();
    tbb::parallel_for(std::int64_t{0}, count.z * count.y, [&](std::int64_t row) {
      for (std::int64_t i = 0; i < count.x; ++i) {
        const glm::i64vec3 begin = glm::i64vec3(i, row % count.y, row / count.y) * blocks;
        to[static_cast<std::size_t>(row * count.x + i)] = mean(from, size, begin, glm::min(begin + blocks, size));
      }
    });
  });
  return coarse;
}

}  // namespace tetwarp::viewer
