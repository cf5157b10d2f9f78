// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/body.h"

#include <algorithm>

namespace tetwarp::truth {

namespace {

/// Marks the cells of a slice that can be reached from its rim without a step over the body.
std::vector<std::uint8_t> outside_of(const std::uint8_t* body, std::int64_t columns, std::int64_t rows) {
  std::vector<std::uint8_t> outside(static_cast<std::size_t>(columns * rows));
  std::vector<std::int64_t> next;
  const auto reach = [&](std::int64_t i, std::int64_t j) {
    const std::int64_t at = i + columns * j;
    if (i < 0 || j < 0 || i >= columns || j >= rows || body[at] || outside[static_cast<std::size_t>(at)]) return;
    outside[static_cast<std::size_t>(at)] = 1;
    next.push_back(at);
  };
  for (std::int64_t i = 0; i < columns; ++i) reach(i, 0), reach(i, rows - 1);
  for (std::int64_t j = 0; j < rows; ++j) reach(0, j), reach(columns - 1, j);
  while (!next.empty()) {
    const std::int64_t i = next.back() % columns, j = next.back() / columns;
    next.pop_back();
    reach(i - 1, j), reach(i + 1, j), reach(i, j - 1), reach(i, j + 1);
  }
  return outside;
}

}  // namespace

Volume<std::uint8_t> body_mask(const Geometry& volume, const simulate::Patient& patient, std::int64_t cell_size) {
  const glm::i64vec3 cells = patient.lattice.size - std::int64_t{1}, size = volume.size;
  Volume<std::uint8_t> mask{volume, std::vector<std::uint8_t>(static_cast<std::size_t>(voxel_count(volume)))};
  std::vector<std::uint8_t> outside;
  std::int64_t held = -1;
  std::size_t voxel = 0;
  for (std::int64_t k = 0; k < size.z; ++k) {
    const std::int64_t layer = std::min(k / cell_size, cells.z - 1);
    if (layer != held) outside = outside_of(patient.body.data() + layer * cells.x * cells.y, cells.x, cells.y);
    held = layer;
    for (std::int64_t j = 0; j < size.y; ++j) {
      const std::int64_t row = std::min(j / cell_size, cells.y - 1) * cells.x;
      for (std::int64_t i = 0; i < size.x; ++i, ++voxel)
        mask.voxels[voxel] = !outside[static_cast<std::size_t>(row + std::min(i / cell_size, cells.x - 1))];
    }
  }
  return mask;
}

}  // namespace tetwarp::truth
