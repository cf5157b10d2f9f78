// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/scenario_file.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "deform/errors.h"
#include "io/documents/scenario_parts.h"

namespace tetwarp {

namespace {

using namespace simulate;

constexpr std::size_t kMostEntries = 1000, kMostTissues = 255, kMostPhases = 100000;
constexpr std::int64_t kMostFrames = 10000, kLargestCell = 512, kMostSteps = 1000000;
constexpr NumberRange kModulus{1e-6, 1e9}, kCompression{0, 1}, kLimit{0, 100}, kShiftMm{-1e4, 1e4};

/// What messages call an entry when a scenario is read: `move[1] "left lip" (line 14)`.
std::string called(const JsonEntry& entry) {
  const std::string name = entry.has("name") ? " \"" + printable(entry.at("name").text()) + "\"" : "";
  return entry.path() + name + " (line " + std::to_string(entry.line()) + ")";
}

TissueClass read_tissue(const JsonEntry& entry) {
  constexpr std::array<const char*, 7> kKeys = {"name",        "hu",      "label", "youngs_modulus_kpa",
                                                "compression", "stretch", "shear"};
  entry.only(kKeys);
  TissueClass one;
  one.tissue.name = entry.at("name").text();
  if (entry.has("hu")) one.hu = read_hu(entry.at("hu"));
  if (entry.has("label")) one.labels = read_labels(entry.at("label"));
  const auto read = [&](const char* key, const NumberRange& range, double& value) {
    if (entry.has(key)) value = entry.at(key).number(range);
  };
  read("youngs_modulus_kpa", kModulus, one.tissue.youngs_modulus_kpa);
  read("compression", kCompression, one.tissue.compression);
  read("stretch", kLimit, one.tissue.stretch);
  read("shear", kLimit, one.tissue.shear);
  return one;
}

std::vector<TissueClass> read_tissues(const JsonEntry& entry) {
  std::vector<TissueClass> tissues;
  const std::vector<JsonEntry> items = entry.items(1, kMostTissues);
  for (const JsonEntry& item : items) {
    tissues.push_back(read_tissue(item));
    const bool is_last = &item == &items.back(), has_condition = item.has("hu") || item.has("label");
    if (is_last && has_condition)
      item.refuse("has a condition; the last tissue is the rest, whatever its HU and label: leave out hu and label");
    if (!is_last && !has_condition) item.refuse("has no condition, hu or label, so that those after it are never met");
  }
  return tissues;
}

Rotation read_rotation(const JsonEntry& entry) {
  constexpr std::array<const char*, 3> kKeys = {"about", "axis", "degrees"};
  entry.only(kKeys);
  return {read_point(entry.at("about")), entry.at("axis").direction(), entry.at("degrees").number({-180, 180})};
}

/// A vector for each frame.
std::vector<glm::dvec3> read_way(const JsonEntry& entry, const NumberRange& range) {
  std::vector<glm::dvec3> way;
  for (const JsonEntry& item : entry.items(1, static_cast<std::size_t>(kMostFrames))) way.push_back(item.vector(range));
  return way;
}

Move read_move(const JsonEntry& entry, Method method) {
  constexpr std::array<const char*, 8> kKeys = {"region", "handle",  "by_mm",   "by_body",
                                                "rotate", "drag_mm", "force_n", "name"};
  entry.only(kKeys);
  Move move{.what = {}, .how = {}, .entry = called(entry)};
  if (entry.has("name")) move.name = entry.at("name").text();
  if (entry.one_of(std::span(kKeys).first(2)) == 0) {
    move.what = read_zone(entry.at("region"));
  } else {
    constexpr std::array<const char*, 3> kHandleKeys = {"at", "radius_mm", "radius_body"};
    const JsonEntry handle = entry.at("handle");
    handle.only(kHandleKeys);
    move.what = Handle{read_point(handle.at("at")), read_length(handle, "radius_mm", "radius_body")};
  }
  switch (entry.one_of(std::span(kKeys).subspan(2, 5))) {
    case 0: move.how = Shift{entry.at("by_mm").vector(kShiftMm), Unit::mm}; break;
    case 1: move.how = Shift{entry.at("by_body").vector({-10, 10}), Unit::body}; break;
    case 2: move.how = read_rotation(entry.at("rotate")); break;
    case 3: move.how = Drag{read_way(entry.at("drag_mm"), kShiftMm)}; break;
    default:
      if (method == Method::chainmail)
        entry.at("force_n").refuse("is a force, which chainmail knows nothing of; mass-spring does");
      move.how = Force{entry.at("force_n").vector({-1e6, 1e6})};
  }
  return move;
}

std::vector<Move> read_moves(const JsonEntry& entry, Method method, std::size_t fewest) {
  std::vector<Move> moves;
  for (const JsonEntry& item : entry.items(fewest, kMostEntries)) moves.push_back(read_move(item, method));
  return moves;
}

std::vector<CutPlan> read_cuts(const JsonEntry& entry) {
  std::vector<CutPlan> cuts;
  for (const JsonEntry& item : entry.items(1, kMostEntries)) {
    CutPlan cut = read_cut(item);
    for (const CutPlan& other : cuts) {
      if (other.name == cut.name)
        item.at("name").refuse("is \"" + printable(cut.name) + "\", the name of another cut; give each its own");
    }
    cuts.push_back(std::move(cut));
  }
  return cuts;
}

/// The frames of a phase whose moves are read: as many as `frames` says, or else as the ways of drags and balls have
/// places; all of these need as many.
int read_frames(const JsonEntry& entry, const Phase& phase) {
  struct Way {
    JsonEntry entry;
    std::size_t places;
  };
  std::vector<Way> ways;
  if (!phase.moves.empty()) {
    const std::vector<JsonEntry> moves = entry.at("move").items(0, kMostEntries);
    for (std::size_t n = 0; n < moves.size(); ++n) {
      if (const auto* drag = std::get_if<Drag>(&phase.moves[n].how))
        ways.push_back({moves[n].at("drag_mm"), drag->by_mm.size()});
    }
  }
  if (phase.push) ways.push_back({entry.at("push").at("path_mm"), phase.push->at_mm.size()});
  std::size_t frames = ways.empty() ? 1 : ways.front().places;
  if (entry.has("frames")) frames = static_cast<std::size_t>(entry.at("frames").whole_number(1, kMostFrames));
  for (const Way& way : ways) {
    if (way.places == frames) continue;
    way.entry.refuse("has " + std::to_string(way.places) + " places, and the phase " + std::to_string(frames) +
                     " frames; a place a frame is expected");
  }
  return static_cast<int>(frames);
}

std::vector<HeldZone> read_held(const JsonEntry& entry) {
  std::vector<HeldZone> zones;
  for (const JsonEntry& item : entry.items(0, kMostEntries))
    zones.push_back({read_zone(item), item.path() + " (line " + std::to_string(item.line()) + ")"});
  return zones;
}

Push read_push(const JsonEntry& entry) {
  constexpr std::array<const char*, 2> kKeys = {"radius_mm", "path_mm"};
  entry.only(kKeys);
  return {entry.at("radius_mm").number({0, 1e5, true}), read_way(entry.at("path_mm"), kCoordinateMm)};
}

Phase read_phase(const JsonEntry& entry, const Scenario& scenario) {
  constexpr std::array<const char*, 6> kKeys = {"name", "move", "pin", "push", "closed_cuts", "frames"};
  entry.only(kKeys);
  Phase phase;
  phase.name = entry.has("name") ? entry.at("name").text() : entry.path();
  if (entry.has("move")) phase.moves = read_moves(entry.at("move"), scenario.method, 0);
  if (entry.has("pin")) phase.pins = read_held(entry.at("pin"));
  if (entry.has("push")) phase.push = read_push(entry.at("push"));
  phase.frames = read_frames(entry, phase);
  if (!entry.has("closed_cuts")) return phase;
  for (const JsonEntry& item : entry.at("closed_cuts").items(0, kMostEntries)) {
    const std::string& name = item.text();
    if (std::none_of(scenario.cuts.begin(), scenario.cuts.end(),
                     [&](const CutPlan& cut) { return cut.name == name; })) {
      std::string known;
      for (const CutPlan& cut : scenario.cuts) known += (known.empty() ? "" : ", ") + printable(cut.name);
      item.refuse("is \"" + printable(name) + "\", which is no cut; " +
                  (known.empty() ? "the scenario has no cuts" : "the cuts are " + known));
    }
    phase.closed_cuts.push_back(name);
  }
  return phase;
}

std::vector<Phase> read_phases(const JsonEntry& entry, const Scenario& scenario) {
  if (!entry.has("phases")) {
    Phase only;
    if (!entry.has("move")) entry.refuse("has no \"move\" and no \"phases\"; one of them is expected");
    only.moves = read_moves(entry.at("move"), scenario.method, 1);
    only.frames = read_frames(entry, only);
    return {only};
  }
  for (const char* key : {"move", "frames"}) {
    if (entry.has(key)) entry.at(key).refuse("stands beside phases; put it into them");
  }
  std::vector<Phase> phases;
  for (const JsonEntry& item : entry.at("phases").items(1, kMostPhases)) phases.push_back(read_phase(item, scenario));
  return phases;
}

StoppingRule read_stop(const JsonEntry& entry) {
  constexpr std::array<const char*, 3> kKeys = {"motion_mm", "residual", "steps"};
  entry.only(kKeys);
  StoppingRule stop;
  if (entry.has("motion_mm")) stop.motion_mm = entry.at("motion_mm").number({0, 1e3, true});
  if (entry.has("residual")) stop.residual = entry.at("residual").number({0, 1, true});
  if (entry.has("steps")) stop.steps = static_cast<int>(entry.at("steps").whole_number(1, kMostSteps));
  return stop;
}

Method read_method(const JsonEntry& entry) {
  const std::string& name = entry.text();
  if (name == "chainmail") return Method::chainmail;
  if (name != "mass-spring") entry.refuse("is \"" + printable(name) + "\"; chainmail or mass-spring is expected");
  return Method::mass_spring;
}

Scenario read_whole(const JsonEntry& entry) {
  constexpr std::array<const char*, 14> kKeys = {"$schema",       "name",    "description", "method",     "cell_size",
                                                 "body_above_hu", "tissues", "hold",        "move",       "cuts",
                                                 "phases",        "frames",  "stop",        "deadband_mm"};
  entry.only(kKeys);
  for (const char* key : {"$schema", "description"}) {
    if (entry.has(key) && !entry.at(key).is(JsonTree::Kind::text)) entry.at(key).refuse("is no text");
  }
  Scenario scenario;
  if (entry.has("name")) scenario.name = entry.at("name").text();
  if (entry.has("description")) scenario.description = entry.at("description").any_text();
  scenario.method = read_method(entry.at("method"));
  if (entry.has("cell_size")) scenario.cell_size = entry.at("cell_size").whole_number(1, kLargestCell);
  if (entry.has("body_above_hu")) scenario.body_above_hu = entry.at("body_above_hu").number({-1e5, 1e5});
  scenario.tissues = {{.tissue = {.name = "tissue"}, .hu = {}, .labels = {}}};
  if (entry.has("tissues")) scenario.tissues = read_tissues(entry.at("tissues"));
  if (entry.has("hold")) scenario.hold = read_held(entry.at("hold"));
  if (entry.has("cuts")) scenario.cuts = read_cuts(entry.at("cuts"));
  scenario.phases = read_phases(entry, scenario);
  if (entry.has("stop")) scenario.stop = read_stop(entry.at("stop"));
  if (entry.has("deadband_mm")) scenario.deadband_mm = entry.at("deadband_mm").number({0, 10});
  return scenario;
}

}  // namespace

simulate::Scenario read_scenario(const std::filesystem::path& path) {
  const std::string name = path.string();
  const JsonTree tree = read_json(path, "a scenario", kMostScenarioBytes);
  return read_whole(JsonEntry(tree, "", name, "the scenario"));
}

}  // namespace tetwarp
