// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/spring_grid.h"

#include <algorithm>

namespace tetwarp::simulate {

SpringGrid::SpringGrid(const Model& model) : nodes(model.nodes()) {
  std::ptrdiff_t furthest = 0;
  for (int d = kUp; d < kDirections; ++d) {
    const std::ptrdiff_t far = link_distance(model.lattice, d);
    distance[static_cast<std::size_t>(d - kUp)] = far;
    furthest = std::max(furthest, far);
  }
  padding = static_cast<std::size_t>(furthest) + kLanes;
  for (std::vector<float>& values : stiffness) values.assign(nodes + 2 * padding, 0);
  for (std::size_t n = 0; n < nodes; ++n) {
    if (n % kBlock == 0) first_odd.push_back(odd.size());
    for (int d = 0; d < kDirections; ++d) {
      const std::size_t link = model.link(d, n);
      const std::int32_t other = model.neighbour[link];
      if (other < 0) continue;
      const std::size_t up = static_cast<std::size_t>(d < kUp ? opposite(d) : d) - kUp;
      const std::ptrdiff_t far = d < kUp ? -distance[up] : distance[up];
      if (static_cast<std::ptrdiff_t>(n) + far != other) {
        odd.push_back({static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(other), d, model.stiffness[link]});
      } else if (d >= kUp) {
        stiffness[up][padding + n] = model.stiffness[link];
      }
    }
  }
  first_odd.push_back(odd.size());
  odd_matrix.resize(odd.size());
}

}  // namespace tetwarp::simulate
