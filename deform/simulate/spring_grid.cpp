// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/spring_grid.h"

#include <algorithm>

namespace tetwarp::simulate {

SpringGrid::SpringGrid(const Model& model) : nodes(model.nodes()) {
  std::array<std::ptrdiff_t, kDirections> distance;
  for (int d = 0; d < kDirections; ++d) distance[static_cast<std::size_t>(d)] = link_distance(model.lattice, d);
  const std::ptrdiff_t furthest = *std::max_element(distance.begin(), distance.end());
  padding = static_cast<std::size_t>(furthest) + kLanes;
  for (std::vector<float>& values : stiffness) values.assign(nodes + 2 * padding, 0);
  for (std::size_t n = 0; n < nodes; ++n) {
    if (n % kBlock == 0) first_odd.push_back(odd.size());
    for (int d = 0; d < kDirections; ++d) {
      const std::size_t link = model.link(d, n);
      const std::int32_t other = model.neighbour[link];
      if (other < 0) continue;
      if (static_cast<std::ptrdiff_t>(n) + distance[static_cast<std::size_t>(d)] != other) {
        odd.push_back({static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(other), d, model.stiffness[link]});
      } else if (d >= kUp) {
        stiffness[static_cast<std::size_t>(d - kUp)][padding + n] = model.stiffness[link];
      }
    }
  }
  first_odd.push_back(odd.size());
  odd_matrix.resize(odd.size());
}

}  // namespace tetwarp::simulate
