// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <nlohmann/json.hpp>

#include "deform/errors.h"
#include "io/scenario_file.h"

namespace tetwarp {

namespace {

using namespace simulate;
using Json = nlohmann::ordered_json;

Json json_of(const glm::dvec3& v) { return {v.x, v.y, v.z}; }
Json json_of(const std::vector<glm::dvec3>& way) {
  Json list = Json::array();
  for (const glm::dvec3& v : way) list.push_back(json_of(v));
  return list;
}
Json json_of(const ScenarioPoint& point) { return {{point.unit == Unit::mm ? "mm" : "body", json_of(point.at)}}; }

/// Puts a length under the key of its unit: `radius_mm` or `radius_body`.
void put(Json& to, const std::string& name, const Length& length) {
  to[name + (length.unit == Unit::mm ? "_mm" : "_body")] = length.value;
}

Json json_of(const HuRange& range) {
  const auto end = [](double hu) { return std::isinf(hu) ? Json(nullptr) : Json(hu); };
  return {end(range.low), end(range.high)};
}

Json json_of(const Zone& zone);
Json json_of(const std::vector<Zone>& zones) {
  Json list = Json::array();
  for (const Zone& zone : zones) list.push_back(json_of(zone));
  return list;
}

/// What stands in the place of a zone: an object of one key.
struct ZoneInJson {
  Json operator()(const Sphere& sphere) const {
    Json of{{"at", json_of(sphere.at)}};
    put(of, "radius", sphere.radius);
    return {{"sphere", of}};
  }
  Json operator()(const AlignedBox& box) const {
    return {{"box", {{"from", json_of(box.from)}, {"to", json_of(box.to)}}}};
  }
  Json operator()(const HalfSpace& half) const {
    return {{"half_space", {{"at", json_of(half.at)}, {"normal", json_of(half.normal)}}}};
  }
  Json operator()(const HuRange& range) const { return {{"hu", json_of(range)}}; }
  Json operator()(const Labels& labels) const { return {{"label", labels.values}}; }
  Json operator()(const Border&) const { return {{"border", true}}; }
  Json operator()(const Body&) const { return {{"body", true}}; }
  Json operator()(const AllOf& all) const { return {{"all_of", json_of(all.parts)}}; }
  Json operator()(const AnyOf& any) const { return {{"any_of", json_of(any.parts)}}; }
  Json operator()(const Not& other) const { return {{"not", json_of(other.part.front())}}; }
};
Json json_of(const Zone& zone) { return std::visit(ZoneInJson{}, zone.shape); }

Json json_of(const std::vector<HeldZone>& zones) {
  Json list = Json::array();
  for (const HeldZone& held : zones) list.push_back(json_of(held.zone));
  return list;
}

Json json_of(const TissueClass& one) {
  Json of{{"name", one.tissue.name}};
  if (one.hu) of["hu"] = json_of(*one.hu);
  if (!one.labels.empty()) of["label"] = one.labels;
  of["youngs_modulus_kpa"] = one.tissue.youngs_modulus_kpa;
  of["compression"] = one.tissue.compression;
  of["stretch"] = one.tissue.stretch;
  of["shear"] = one.tissue.shear;
  return of;
}

/// Puts a cut's shape into the object that has its name.
struct PutCut {
  Json& to;

  void operator()(const PlaneCutPlan& plane) const {
    to["plane"] = {{"at", json_of(plane.at)}, {"normal", json_of(plane.normal)}};
  }
  void operator()(const DiscCutPlan& disc) const {
    to["disc"] = {{"at", json_of(disc.at)}, {"normal", json_of(disc.normal)}};
    put(to["disc"], "radius", disc.radius);
  }
  void operator()(const SweptCutPlan& swept) const {
    Json path = Json::array();
    for (const ScenarioPoint& place : swept.path) path.push_back(json_of(place));
    to["swept"] = {{"path", path}, {"along", json_of(swept.along)}};
    put(to["swept"], "depth", swept.depth);
    to["swept"]["closed"] = swept.is_closed;
  }
};

Json json_of(const CutPlan& cut) {
  Json of{{"name", cut.name}};
  std::visit(PutCut{of}, cut.shape);
  return of;
}

/// Puts what moves some tissue into the object of a move.
struct PutMotion {
  Json& to;

  void operator()(const Shift& shift) const { to[shift.unit == Unit::mm ? "by_mm" : "by_body"] = json_of(shift.by); }
  void operator()(const Rotation& turn) const {
    to["rotate"] = {{"about", json_of(turn.about)}, {"axis", json_of(turn.axis)}, {"degrees", turn.degrees}};
  }
  void operator()(const Force& force) const { to["force_n"] = json_of(force.newton); }
  void operator()(const Drag& drag) const { to["drag_mm"] = json_of(drag.by_mm); }
};

Json json_of(const Move& move) {
  Json of = Json::object();
  if (!move.name.empty()) of["name"] = move.name;
  if (const auto* zone = std::get_if<Zone>(&move.what)) {
    of["region"] = json_of(*zone);
  } else {
    const auto& handle = std::get<Handle>(move.what);
    of["handle"] = {{"at", json_of(handle.at)}};
    put(of["handle"], "radius", handle.radius);
  }
  std::visit(PutMotion{of}, move.how);
  return of;
}

Json json_of(const std::vector<Move>& moves) {
  Json list = Json::array();
  for (const Move& move : moves) list.push_back(json_of(move));
  return list;
}

Json json_of(const Phase& phase) {
  Json of = Json::object();
  if (!phase.name.empty()) of["name"] = phase.name;
  of["frames"] = phase.frames;
  if (!phase.closed_cuts.empty()) of["closed_cuts"] = phase.closed_cuts;
  if (!phase.pins.empty()) of["pin"] = json_of(phase.pins);
  if (phase.push) of["push"] = {{"radius_mm", phase.push->radius_mm}, {"path_mm", json_of(phase.push->at_mm)}};
  if (!phase.moves.empty()) of["move"] = json_of(phase.moves);
  return of;
}

/// A list of objects under a key, each on a line.
template <class Of>
std::string lines(const char* key, const std::vector<Of>& list) {
  std::string text = std::string("  \"") + key + "\": [";
  for (std::size_t n = 0; n < list.size(); ++n) text += (n > 0 ? ",\n    " : "\n    ") + json_of(list[n]).dump();
  return text + "\n  ]";
}

}  // namespace

std::string scenario_text(const Scenario& scenario) {
  std::string text = "{\n";
  const auto put_line = [&](const char* key, const Json& value) {
    text += std::string("  \"") + key + "\": " + value.dump() + ",\n";
  };
  if (!scenario.name.empty()) put_line("name", scenario.name);
  if (!scenario.description.empty()) put_line("description", scenario.description);
  put_line("method", scenario.method == Method::chainmail ? "chainmail" : "mass-spring");
  put_line("cell_size", scenario.cell_size);
  put_line("body_above_hu", scenario.body_above_hu);
  text += lines("tissues", scenario.tissues) + ",\n";
  if (!scenario.hold.empty()) put_line("hold", json_of(scenario.hold));
  if (!scenario.cuts.empty()) text += lines("cuts", scenario.cuts) + ",\n";
  put_line(
      "stop",
      {{"motion_mm", scenario.stop.motion_mm}, {"residual", scenario.stop.residual}, {"steps", scenario.stop.steps}});
  put_line("deadband_mm", scenario.deadband_mm);
  std::vector<Phase> phases = scenario.phases;
  require(!phases.empty(), "a scenario without phases cannot be written");
  const Phase& first = phases.front();
  const bool is_plain = first.name.empty() && first.pins.empty() && !first.push && first.closed_cuts.empty();
  if (phases.size() == 1 && is_plain && !first.moves.empty()) {  // of a scenario without "phases"
    text += "  \"frames\": " + std::to_string(phases[0].frames) + ",\n";
    return text + lines("move", phases[0].moves) + "\n}\n";
  }
  for (std::size_t n = 0; n < phases.size(); ++n)  // what those without a name are called
    if (phases[n].name == "phases[" + std::to_string(n) + "]") phases[n].name.clear();
  return text + lines("phases", phases) + "\n}\n";
}

}  // namespace tetwarp
