// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/cuts/lattice_cut.h"

#include <cmath>
#include <glm/common.hpp>

#include "deform/simulate/cuts/cut_surface.h"

namespace tetwarp::simulate {

LatticeCut divide_by(const Geometry& lattice, const LatticeNumbers& grid, const Cut& cut) {
  constexpr double kNearest = 1.0 / 256;  // of the shortest side of a cell
  const CutSurface surface(cut);
  const AffineMap point = point_from_index(lattice);
  const glm::dvec3& h = lattice.spacing;
  const double farthest = 0.5 * std::max({h.x, h.y, h.z});
  LatticeCut division;
  division.nearest = kNearest * std::min({h.x, h.y, h.z});
  const auto vertices = static_cast<std::uint32_t>(voxel_count(lattice));
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const double side = surface.side(point(glm::dvec3(grid.place_of_vertex(v))));
    division.side.push_back(std::copysign(std::max(std::fabs(side), division.nearest), side));
  }
  const auto cells = static_cast<std::uint64_t>(grid.cells().x * grid.cells().y * grid.cells().z);
  for (std::uint64_t cell = 0; cell < cells; ++cell) {
    glm::dvec3 sum(0);  // sum of the places where the cut goes through edges, lattice index
    int crossings = 0;
    for (std::uint32_t a = 0; a < kCorners; ++a) {
      for (const std::uint32_t axis : {1u, 2u, 4u}) {
        if (a & axis) continue;
        const std::uint32_t from = grid.vertex(cell, a), to = grid.vertex(cell, a | axis);
        const double at = division.side[from], other = division.side[to];
        if ((at < 0) == (other < 0)) continue;
        sum +=
            glm::mix(glm::dvec3(grid.place_of_vertex(from)), glm::dvec3(grid.place_of_vertex(to)), at / (at - other));
        ++crossings;
      }
    }
    if (crossings == 0) continue;
    const glm::dvec3 middle = point(sum / static_cast<double>(crossings));
    if (std::fabs(surface.side(middle)) <= farthest && surface.reaches(middle)) division.cells.push_back(cell);
  }
  return division;
}

std::vector<std::uint64_t> with_neighbours(const LatticeNumbers& grid, const std::vector<LatticeCut>& divisions) {
  std::vector<std::uint64_t> result;
  for (const LatticeCut& division : divisions) {
    for (const std::uint64_t cell : division.cells) {
      const glm::i64vec3 at = grid.place_of_cell(cell);
      const glm::i64vec3 low = glm::max(at - std::int64_t{1}, glm::i64vec3(0)),
                         high = glm::min(at + std::int64_t{1}, grid.cells() - std::int64_t{1});
      for (std::int64_t k = low.z; k <= high.z; ++k) {
        for (std::int64_t j = low.y; j <= high.y; ++j) {
          for (std::int64_t i = low.x; i <= high.x; ++i) result.push_back(grid.cell({i, j, k}));
        }
      }
    }
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace tetwarp::simulate
