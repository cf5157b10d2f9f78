// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/spring_grid.h"

#include <algorithm>

namespace tetwarp::simulate {

SpringGrid::SpringGrid(const Model& model) : nodes(model.nodes()) {
  const glm::i64vec3& size = model.lattice.size;
  std::ptrdiff_t furthest = 0;
  for (int d = 0; d < kDirections; ++d) {
    const glm::dvec3 along = rest_link(model.lattice, d);
    rest[static_cast<std::size_t>(d)] = {along, std::sqrt(dot3(along, along))};
    if (d < kUp) continue;
    const glm::i64vec3 steps(link_steps(d));
    const std::ptrdiff_t far = steps.x + size.x * (steps.y + size.y * steps.z);
    distance[static_cast<std::size_t>(d - kUp)] = far;
    furthest = std::max(furthest, far);
  }
  padding = static_cast<std::size_t>(furthest) + kLanes;
  for (Padded<float>& values : stiffness) values = Padded<float>(nodes, padding);
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
        stiffness[up][n] = model.stiffness[link];
      }
    }
  }
  first_odd.push_back(odd.size());
}

}  // namespace tetwarp::simulate
