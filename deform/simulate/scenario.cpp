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
constexpr double kTouch = 0.01;  ///< of a ball's radius

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
      way_of_(patient.vertex_hu.size(), kFree),
      push_(phase.push),
      frames_(phase.frames) {
  check_ways(phase);
  hold(scenario.hold, patient, kHeld);
  hold(phase.pins, patient, kPinned);
  held_ = static_cast<std::size_t>(std::count(way_of_.begin(), way_of_.end(), kHeld));
  pinned_ = static_cast<std::size_t>(std::count(way_of_.begin(), way_of_.end(), kPinned));
  if (push_) {
    require(patient.box.has_value(), "a ball pushes the body, but no cell of this volume belongs to one");
    body_ = select(Zone{Body{}}, patient);
  }
  std::vector<std::vector<std::size_t>> vertices;
  for (std::size_t n = 0; n < phase.moves.size(); ++n) {
    const Move& move = phase.moves[n];
    vertices.push_back(free_vertices(move, patient));
    Way way;
    if (const auto* shift = std::get_if<Shift>(&move.how)) way.by = mm_of(*shift, patient);
    if (const auto* drag = std::get_if<Drag>(&move.how)) way.along = drag->by_mm;
    if (const auto* turn = std::get_if<Rotation>(&move.how)) {
      way.about = point_of(turn->about, patient);
      way.axis = glm::normalize(turn->axis);
      way.radians = turn->degrees * std::acos(-1.0) / 180;
    }
    ways_.push_back(std::move(way));
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
  require(scenario.method == Method::chainmail || held_ + pinned_ + moved_ > 0,
          "nothing is held and nothing moved to a place" + (phase.name.empty() ? "" : " in \"" + phase.name + "\"") +
              ", so that mass-spring has no equilibrium; hold something");
}

void PhaseLoads::check_ways(const Phase& phase) const {
  const auto check = [&](const std::string& entry, std::size_t places) {
    require(places == static_cast<std::size_t>(phase.frames),
            entry + " has " + std::to_string(places) + " places, and its phase " + std::to_string(phase.frames) +
                " frames; a place a frame is expected");
  };
  for (const Move& move : phase.moves) {
    if (const auto* drag = std::get_if<Drag>(&move.how)) check(move.entry, drag->by_mm.size());
  }
  if (phase.push) check("the ball of \"" + phase.name + "\"", phase.push->at_mm.size());
}

/// Takes what is still free of some zones.
void PhaseLoads::hold(std::span<const HeldZone> zones, const Patient& patient, std::int32_t as) {
  for (const HeldZone& held : zones) {
    const std::vector<std::uint8_t> inside = select(held.zone, patient);
    bool any = false;
    for (std::size_t vertex = 0; vertex < inside.size(); ++vertex) {
      if (!inside[vertex]) continue;
      any = true;
      if (way_of_[vertex] == kFree) way_of_[vertex] = as;
    }
    if (!any) notes_.push_back(held.entry + (as == kHeld ? " holds no vertex" : " pins no vertex"));
  }
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
  std::erase_if(vertices, [&](std::size_t vertex) { return way_of_[vertex] == kHeld || way_of_[vertex] == kPinned; });
  const char* how = pinned_ == 0 ? "held, and what is held stays" : "held or pinned, and stay";
  require(!vertices.empty(), move.entry + " moves nothing: " + std::to_string(all) + " of its " + std::to_string(all) +
                                 " vertices are " + how);
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
    const glm::dvec3 x = rest_of(vertex);
    if (is_same_way(move, other, x)) continue;
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

void PhaseLoads::extend(std::span<const glm::dvec3> drags, const std::optional<glm::dvec3>& ball) {
  const auto has_way = [](const Way& way) { return !way.along.empty(); };
  require(static_cast<std::size_t>(std::count_if(ways_.begin(), ways_.end(), has_way)) == drags.size() &&
              push_.has_value() == ball.has_value(),
          "a further frame needs a place for each drag, and one for the ball");
  std::size_t drag = 0;
  for (Way& way : ways_)
    if (!way.along.empty()) way.along.push_back(drags[drag++]);
  if (push_) push_->at_mm.push_back(*ball);
  ++frames_;
}

bool PhaseLoads::changes_by_frame() const {
  return pushes() ||
         std::any_of(ways_.begin(), ways_.end(), [](const Way& way) { return way.radians != 0 || !way.along.empty(); });
}

bool PhaseLoads::changes_in(int frame) const {
  if (frame == 0 || pushes() || !force_.empty()) return true;
  const auto now = static_cast<std::size_t>(frame);
  return std::any_of(ways_.begin(), ways_.end(),
                     [now](const Way& way) { return way.along.empty() || way.along[now] != way.along[now - 1]; });
}

int PhaseLoads::frame_at(double part) const {
  return std::clamp(static_cast<int>(std::lround(part * frames_)), 1, frames_) - 1;
}

glm::dvec3 PhaseLoads::rest_of(std::size_t vertex) const {
  const auto n = static_cast<std::int64_t>(vertex);
  return vertex_point_(glm::dvec3(n % size_.x, n / size_.x % size_.y, n / (size_.x * size_.y)));
}

/// Whether two moves take a vertex to the same goals: of drags in every frame.
bool PhaseLoads::is_same_way(std::size_t move, std::size_t other, const glm::dvec3& point) const {
  const bool drags = !ways_[move].along.empty();
  if (drags != !ways_[other].along.empty()) return false;
  for (int frame = drags ? 0 : frames_ - 1; frame < frames_; ++frame) {
    const double part = static_cast<double>(frame + 1) / frames_;
    if (glm::distance(displacement(move, point, part), displacement(other, point, part)) > kSameGoalMm) return false;
  }
  return true;
}

PhaseCounts PhaseLoads::counts() const {
  const auto pulled =
      std::count_if(force_.begin(), force_.end(), [](const glm::vec3& force) { return force != glm::vec3(0); });
  return {held_, pinned_, moved_, static_cast<std::size_t>(pulled)};
}

glm::dvec3 PhaseLoads::displacement(std::size_t move, const glm::dvec3& point, double part) const {
  const Way& way = ways_[move];
  if (!way.along.empty()) return way.along[static_cast<std::size_t>(frame_at(part))];
  if (way.radians == 0) return part * way.by;
  const glm::dvec3 arm = point - way.about;
  return turned(arm, way.axis, part * way.radians) - arm;
}

Loads PhaseLoads::at(double part, const Model& model, std::span<const glm::vec3> start,
                     std::span<const glm::vec3> now) const {
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
    if (way == kPinned) {
      loads.goal[vertex] = start[vertex];
      continue;
    }
    const glm::dvec3 by = displacement(static_cast<std::size_t>(way), rest_of(vertex), part);
    const double kept = ways_[static_cast<std::size_t>(way)].along.empty() ? 1 - part : 1;  // a drag begins where it is
    for (int axis = 0; axis < 3; ++axis)
      loads.goal[vertex][axis] = static_cast<float>(by[axis] + kept * static_cast<double>(start[vertex][axis]));
  }
  if (push_) push(frame_at(part), model, now, loads);
  return loads;
}

/// Places the free nodes that the ball meets in a frame.
void PhaseLoads::push(int frame, const Model& model, std::span<const glm::vec3> now, Loads& loads) const {
  const glm::dvec3& centre = push_->at_mm[static_cast<std::size_t>(frame)];
  const double radius = push_->radius_mm, touched = radius * (1 + kTouch);
  for (std::size_t node = 0; node < model.nodes(); ++node) {
    const std::size_t vertex = model.vertex[node];
    if (body_[vertex] == 0 || loads.constraint[node] == Constraint::placed) continue;
    const glm::dvec3 rest = rest_of(vertex), from = rest + glm::dvec3(now[node]) - centre;
    // Products and sums in this order, and a root, which every processor rounds alike.
    const double away = std::sqrt((from.x * from.x + from.y * from.y) + from.z * from.z);
    if (!(away < touched)) continue;
    loads.constraint[node] = Constraint::placed;
    loads.goal[node] = now[node];
    if (!(away < radius)) continue;
    const glm::dvec3 out = away > 0 ? from * (radius / away) : glm::dvec3(0, 0, radius);  // from its centre: upwards
    loads.goal[node] = glm::vec3(centre + out - rest);
  }
}

}  // namespace tetwarp::simulate
