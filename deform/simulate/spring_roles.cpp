// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/spring_roles.h"

#include <cmath>

#include "deform/errors.h"

namespace tetwarp::simulate {

namespace {

constexpr double kMostMm = 1e6, kMostNewton = 1e9;

void require_size(std::size_t size, const Model& model, const char* what) {
  require(size == model.nodes(), std::string("one ") + what + " a node is expected, " + std::to_string(model.nodes()) +
                                     "; found " + std::to_string(size));
}

bool is_within(const glm::vec3& v, double most) {
  return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;  // false for NaN
}

void require_within(const glm::vec3& v, double most, std::size_t node, const char* what, const char* unit) {
  if (is_within(v, most)) return;
  throw InputError(std::string("the ") + what + " of node " + std::to_string(node) + " is (" + std::to_string(v.x) +
                   ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ") " + unit + "; expected at most " +
                   std::to_string(most) + " on an axis");
}

bool is_zero(const glm::vec3& v) { return v.x == 0 && v.y == 0 && v.z == 0; }

}  // namespace

std::vector<SpringRole> roles(const Model& model, std::span<const Constraint> constraint) {
  std::vector<SpringRole> result(model.nodes(), SpringRole::kept);
  std::vector<std::uint32_t> front;
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    if (constraint[n] != Constraint::placed) continue;
    result[n] = SpringRole::placed;
    front.push_back(static_cast<std::uint32_t>(n));
  }
  while (!front.empty()) {
    const std::size_t n = front.back();
    front.pop_back();
    for (int d = 0; d < kDirections; ++d) {
      const std::size_t link = model.link(d, n);
      if (model.neighbour[link] < 0 || !(model.stiffness[link] > 0)) continue;
      const auto other = static_cast<std::uint32_t>(model.neighbour[link]);
      if (result[other] != SpringRole::kept) continue;
      result[other] = SpringRole::free;
      front.push_back(other);
    }
  }
  return result;
}

void require_loads(const Model& model, const Loads& loads) {
  require_size(loads.constraint.size(), model, "hold");
  require_size(loads.goal.size(), model, "goal");
  if (!loads.force.empty()) require_size(loads.force.size(), model, "force");
  bool any_placed = false;
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    if (!loads.force.empty()) require_within(loads.force[n], kMostNewton, n, "force", "N");
    if (loads.constraint[n] != Constraint::placed) continue;
    require_within(loads.goal[n], kMostMm, n, "goal", "mm");
    any_placed = true;
  }
  if (any_placed) return;
  for (std::size_t n = 0; n < loads.force.size(); ++n) {
    if (is_zero(loads.force[n])) continue;
    throw InputError("there is a force on node " + std::to_string(n) +
                     " and no placed node to hold against it; place at least one");
  }
}

void require_displacement(const Model& model, std::span<const glm::vec3> displacement) {
  require_size(displacement.size(), model, "displacement");
  for (std::size_t n = 0; n < displacement.size(); ++n) {
    require_within(displacement[n], kMostMm, n, "displacement", "mm");
  }
}

void require_springs(const Model& model) {
  const std::size_t links = kDirections * model.nodes();
  require(model.neighbour.size() == links && model.stiffness.size() == links,
          "a model of " + std::to_string(model.nodes()) + " nodes has " + std::to_string(links) + " links; found " +
              std::to_string(model.neighbour.size()) + " neighbours and " + std::to_string(model.stiffness.size()) +
              " spring constants");
}

}  // namespace tetwarp::simulate
