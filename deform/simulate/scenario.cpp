// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/scenario.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>

#include "deform/errors.h"

namespace tetwarp::simulate {

namespace {

constexpr double kSameGoalMm = 1e-6;

std::string text_of(const glm::dvec3& point) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.1f, %.1f, %.1f)", point.x, point.y, point.z);
  return text;
}

/// Turns a vector about a unit axis, by the right-hand rule (Rodrigues).
glm::dvec3 turned(const glm::dvec3& x, const glm::dvec3& axis, double radians) {
  const double c = std::cos(radians), s = std::sin(radians);
  return c * x + s * glm::cross(axis, x) + (1 - c) * glm::dot(axis, x) * axis;
}

struct CutOfPlan {
  const Patient& patient;

  std::variant<PlaneCut, DiscCut, SweptCut> operator()(const PlaneCutPlan& plan) const {
    return PlaneCut{point_of(plan.at, patient), plan.normal};
  }
  std::variant<PlaneCut, DiscCut, SweptCut> operator()(const DiscCutPlan& plan) const {
    return DiscCut{point_of(plan.at, patient), plan.normal, mm_of(plan.radius, patient)};
  }
  std::variant<PlaneCut, DiscCut, SweptCut> operator()(const SweptCutPlan& plan) const {
    SweptCut cut{{}, glm::normalize(plan.along) * mm_of(plan.depth, patient), plan.is_closed};
    for (const ScenarioPoint& place : plan.path) cut.path.push_back(point_of(place, patient));
    return cut;
  }
};

}  // namespace

int frame_count(const Scenario& scenario) {
  int frames = 0;
  for (const Phase& phase : scenario.phases) frames += phase.frames;
  return frames;
}

bool is_open(const CutPlan& cut, const Phase& phase) {
  return std::find(phase.closed_cuts.begin(), phase.closed_cuts.end(), cut.name) == phase.closed_cuts.end();
}

std::vector<std::uint8_t> tissue_of_cells(const Scenario& scenario, const Patient& patient) {
  for (const TissueClass& one : scenario.tissues) {
    require(one.labels.empty() || !patient.cell_label.empty(),
            "the tissue \"" + one.tissue.name + "\" is given by labels, but there is no label volume; give --labels");
  }
  std::vector<std::uint8_t> result(patient.cell_hu.size());
  for (std::size_t cell = 0; cell < result.size(); ++cell) {
    const auto fits = [&](const TissueClass& one) {
      return (!one.hu || one.hu->contains(static_cast<double>(patient.cell_hu[cell]))) &&
             (one.labels.empty() ||
              std::find(one.labels.begin(), one.labels.end(), patient.cell_label[cell]) != one.labels.end());
    };
    const auto found = std::find_if(scenario.tissues.begin(), scenario.tissues.end(), fits);
    if (found == scenario.tissues.end()) throw InputError("no tissue fits a cell; the last one is without condition");
    result[cell] = static_cast<std::uint8_t>(found - scenario.tissues.begin());
  }
  return result;
}

std::vector<Cut> open_cuts(const Scenario& scenario, const Phase& phase, const Patient& patient) {
  std::vector<Cut> cuts;
  for (const CutPlan& plan : scenario.cuts) {
    if (!is_open(plan, phase)) continue;
    cuts.push_back({plan.name, std::visit(CutOfPlan{patient}, plan.shape)});
  }
  return cuts;
}

PhaseLoads::PhaseLoads(const Scenario& scenario, const Phase& phase, const Patient& patient)
    : vertex_point_(point_from_index(patient.lattice)),
      size_(patient.lattice.size),
      way_of_(patient.vertex_hu.size(), kFree) {
  hold(scenario, patient);
  std::vector<std::vector<std::size_t>> vertices;
  for (std::size_t n = 0; n < phase.moves.size(); ++n) {
    const Move& move = phase.moves[n];
    vertices.push_back(free_vertices(move, patient));
    Way way;
    if (const auto* shift = std::get_if<Shift>(&move.how)) way.by = mm_of(*shift, patient);
    if (const auto* turn = std::get_if<Rotation>(&move.how)) {
      way.about = point_of(turn->about, patient);
      way.axis = glm::normalize(turn->axis);
      way.radians = turn->degrees * std::acos(-1.0) / 180;
    }
    ways_.push_back(way);
    if (!std::holds_alternative<Force>(move.how)) place(phase, n, vertices.back());
  }
  for (std::size_t n = 0; n < phase.moves.size(); ++n) {
    const Move& move = phase.moves[n];
    const auto* force = std::get_if<Force>(&move.how);
    if (force == nullptr) continue;
    require(scenario.method == Method::mass_spring,
            move.entry + " is a force, which chainmail knows nothing of; give by_mm, or the method mass-spring");
    for (const std::size_t vertex : vertices[n]) {
      if (way_of_[vertex] == kFree) continue;
      throw InputError(move.entry + " pulls a vertex that " +
                       phase.moves[static_cast<std::size_t>(way_of_[vertex])].entry +
                       " takes to a place of its own; let them be apart");
    }
    add_force(force->newton, vertices[n]);
  }
  require(scenario.method == Method::chainmail || held_ + moved_ > 0,
          "nothing is held and nothing moved to a place" + (phase.name.empty() ? "" : " in \"" + phase.name + "\"") +
              ", so that mass-spring has no equilibrium; hold something");
}

void PhaseLoads::hold(const Scenario& scenario, const Patient& patient) {
  for (const HeldZone& held : scenario.hold) {
    const std::vector<std::uint8_t> inside = select(held.zone, patient);
    bool any = false;
    for (std::size_t vertex = 0; vertex < inside.size(); ++vertex) {
      if (!inside[vertex]) continue;
      any = true;
      way_of_[vertex] = kHeld;
    }
    if (!any) notes_.push_back(held.entry + " holds no vertex");
  }
  held_ = static_cast<std::size_t>(std::count(way_of_.begin(), way_of_.end(), kHeld));
}

std::vector<std::size_t> PhaseLoads::free_vertices(const Move& move, const Patient& patient) const {
  std::vector<std::size_t> vertices;
  if (const auto* zone = std::get_if<Zone>(&move.what)) {
    const std::vector<std::uint8_t> inside = select(*zone, patient);
    for (std::size_t vertex = 0; vertex < inside.size(); ++vertex) {
      if (inside[vertex]) vertices.push_back(vertex);
    }
    require(!vertices.empty(), move.entry + " moves no vertex: its region is empty in this volume");
  } else {
    const auto& handle = std::get<Handle>(move.what);
    try {
      vertices = grasp(point_of(handle.at, patient), mm_of(handle.radius, patient), patient);
    } catch (const InputError& error) {
      throw InputError(move.entry + ": " + error.what());
    }
  }
  const std::size_t all = vertices.size();
  std::erase_if(vertices, [&](std::size_t vertex) { return way_of_[vertex] == kHeld; });
  require(!vertices.empty(), move.entry + " moves nothing: " + std::to_string(all) + " of its " + std::to_string(all) +
                                 " vertices are held, and what is held stays");
  return vertices;
}

void PhaseLoads::place(const Phase& phase, std::size_t move, const std::vector<std::size_t>& vertices) {
  for (const std::size_t vertex : vertices) {
    if (way_of_[vertex] == kFree) {
      way_of_[vertex] = static_cast<std::int32_t>(move);
      ++moved_;
      continue;
    }
    const auto other = static_cast<std::size_t>(way_of_[vertex]);
    const auto n = static_cast<std::int64_t>(vertex);
    const glm::dvec3 x = vertex_point_(glm::dvec3(n % size_.x, n / size_.x % size_.y, n / (size_.x * size_.y)));
    if (glm::distance(displacement(move, x, 1), displacement(other, x, 1)) <= kSameGoalMm) continue;
    throw InputError(phase.moves[other].entry + " and " + phase.moves[move].entry + " move the vertex at " +
                     text_of(x) + " mm to different places, " + text_of(x + displacement(other, x, 1)) + " and " +
                     text_of(x + displacement(move, x, 1)) + "; let their regions be apart");
  }
}

void PhaseLoads::add_force(const glm::dvec3& newton, const std::vector<std::size_t>& vertices) {
  if (force_.empty()) force_.resize(way_of_.size());
  const glm::dvec3 share = newton / static_cast<double>(vertices.size());
  for (const std::size_t vertex : vertices) {
    glm::vec3& force = force_[vertex];
    for (int axis = 0; axis < 3; ++axis)
      force[axis] = static_cast<float>(static_cast<double>(force[axis]) + share[axis]);
  }
}

bool PhaseLoads::turns() const {
  return std::any_of(ways_.begin(), ways_.end(), [](const Way& way) { return way.radians != 0; });
}

std::size_t PhaseLoads::with_force() const {
  return static_cast<std::size_t>(
      std::count_if(force_.begin(), force_.end(), [](const glm::vec3& force) { return force != glm::vec3(0); }));
}

glm::dvec3 PhaseLoads::displacement(std::size_t move, const glm::dvec3& point, double part) const {
  const Way& way = ways_[move];
  if (way.radians == 0) return part * way.by;
  const glm::dvec3 arm = point - way.about;
  return turned(arm, way.axis, part * way.radians) - arm;
}

Loads PhaseLoads::at(double part, const Model& model, std::span<const glm::vec3> start) const {
  Loads loads{.constraint = std::vector<Constraint>(model.nodes(), Constraint::free),
              .goal = std::vector<glm::vec3>(model.nodes()),
              .force = {}};
  if (!force_.empty()) loads.force.resize(model.nodes());
  for (std::size_t vertex = 0; vertex < way_of_.size(); ++vertex) {
    if (!force_.empty()) loads.force[vertex] = static_cast<float>(part) * force_[vertex];
    const std::int32_t way = way_of_[vertex];
    if (way == kFree) continue;
    loads.constraint[vertex] = Constraint::placed;
    if (way == kHeld) continue;
    const auto n = static_cast<std::int64_t>(vertex);
    const glm::dvec3 x = vertex_point_(glm::dvec3(n % size_.x, n / size_.x % size_.y, n / (size_.x * size_.y)));
    const glm::dvec3 by = displacement(static_cast<std::size_t>(way), x, part);
    for (int axis = 0; axis < 3; ++axis) {
      loads.goal[vertex][axis] = static_cast<float>(by[axis] + (1 - part) * static_cast<double>(start[vertex][axis]));
    }
  }
  return loads;
}

}  // namespace tetwarp::simulate
