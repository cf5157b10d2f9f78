// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/mass_spring.h"
#include "deform/simulate/spring_roles.h"
#include "deform/simulate/spring_step.h"

namespace tetwarp::simulate {

namespace {

/// Calls `work(node, spring, stiffness)` for each spring, once from each of its ends.
template <class Work>
void for_each_spring(const Model& model, std::span<const glm::vec3> displacement, Work&& work) {
  require_springs(model);
  require_displacement(model, displacement);
  for (int d = 0; d < kDirections; ++d) {
    const glm::dvec3 along = rest_link(model.lattice, d);
    const RestLink<double> rest{along, std::sqrt(dot3(along, along))};
    for (std::size_t n = 0; n < model.nodes(); ++n) {
      const std::size_t link = model.link(d, n);
      if (model.neighbour[link] < 0) continue;
      const glm::vec3 &from = displacement[n], &to = displacement[static_cast<std::size_t>(model.neighbour[link])];
      const glm::dvec3 apart(double{to.x} - from.x, double{to.y} - from.y, double{to.z} - from.z);
      work(n, stretched(rest, apart), double{model.stiffness[link]});
    }
  }
}

}  // namespace

double energy(const Model& model, std::span<const glm::vec3> displacement) {
  double sum = 0;
  for_each_spring(model, displacement, [&](std::size_t, const Stretched<double>& spring, double stiffness) {
    sum += Pull(spring, stiffness).energy / 4;
  });
  return sum;
}

std::vector<glm::dvec3> net_forces(const Model& model, std::span<const glm::vec3> displacement) {
  std::vector<glm::dvec3> result(model.nodes(), glm::dvec3(0));
  for_each_spring(model, displacement, [&](std::size_t n, const Stretched<double>& spring, double stiffness) {
    result[n] += Pull(spring, stiffness).force;
  });
  return result;
}

}  // namespace tetwarp::simulate
