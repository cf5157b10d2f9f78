// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/lattice/lattice_part.h"

#include <algorithm>
#include <glm/common.hpp>

namespace tetwarp::cuda_detail {

LatticeFrame part_of(const LatticeFrame& whole, const Slices& cells) {
  LatticeFrame part = whole;
  part.first_slice = whole.first_slice + cells.begin;
  part.cells.z = cells.end - cells.begin;
  return part;
}

Slices cells_reaching(std::span<const SliceReach> vertices, std::int64_t begin, std::int64_t end) {
  Slices cells;
  for (std::size_t k = 0; k + 1 < vertices.size(); ++k) {
    const std::int64_t low = std::min(vertices[k].low, vertices[k + 1].low),
                       high = std::max(vertices[k].high, vertices[k + 1].high);
    if (low > (end - 1) * kStepsPerVoxel || high < begin * kStepsPerVoxel) continue;
    const auto at = static_cast<std::int64_t>(k);
    if (cells.is_empty()) cells.begin = at - at % 2;
    cells.end = at + 1;
  }
  return cells;
}

RestBox rest_box(const LatticeFrame& whole, const Slices& cells) {
  RestBox box{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at(corner & 1 ? whole.cells.x : 0, corner >> 1 & 1 ? whole.cells.y : 0,
                        corner >> 2 ? cells.end : cells.begin);
    const glm::dvec3 place = whole.output_from_lattice(at);
    box.low = glm::min(box.low, place);
    box.high = glm::max(box.high, place);
  }
  const glm::dvec3 margin = whole.beyond_rest() + 1.0 / kStepsPerVoxel;  // vertices are snapped
  return {box.low - margin, box.high + margin};
}

}  // namespace tetwarp::cuda_detail
