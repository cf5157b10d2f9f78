// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/simulate/simulate_report.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "deform/simulate/mass_spring.h"

namespace tetwarp::apps {

namespace {

using namespace simulate;
using nlohmann::json;

constexpr double kLimitToleranceMm = 1e-3;
constexpr std::size_t kMostLinksNamed = 10;

json list_of(const glm::dvec3& v) { return json::array({v.x, v.y, v.z}); }

std::size_t cells_of(const SimulateRecord& record, std::size_t tissue) {
  const std::vector<std::uint8_t>& of_cell = record.run.tissues();
  return static_cast<std::size_t>(std::count(of_cell.begin(), of_cell.end(), tissue));
}

json tissues_json(const SimulateRecord& record) {
  json list = json::array();
  for (std::size_t n = 0; n < record.scenario.tissues.size(); ++n) {
    const Tissue& tissue = record.scenario.tissues[n].tissue;
    list.push_back({{"name", tissue.name},
                    {"cells", cells_of(record, n)},
                    {"youngs_modulus_kpa", tissue.youngs_modulus_kpa},
                    {"compression", tissue.compression},
                    {"stretch", tissue.stretch},
                    {"shear", tissue.shear}});
  }
  return list;
}

json links_json(const SimulateRecord& record, const std::vector<BrokenLink>& broken) {
  json first = json::array();
  const glm::i64vec3& size = record.patient.lattice.size;
  for (std::size_t n = 0; n < std::min(broken.size(), kMostLinksNamed); ++n) {
    const auto vertex = static_cast<std::int64_t>(record.run.model().vertex[broken[n].node]);
    const char axis = "ijk"[broken[n].axis];
    first.push_back({{"vertex", {vertex % size.x, vertex / size.x % size.y, vertex / (size.x * size.y)}},
                     {"axis", std::string(1, axis)},
                     {"beyond_mm", broken[n].beyond_mm}});
  }
  return {{"count", broken.size()}, {"tolerance_mm", kLimitToleranceMm}, {"first", std::move(first)}};
}

json phase_json(const SimulateRecord& record, std::size_t n) {
  const PhaseRecord& phase = record.phases[n];
  const PhaseCounts& counts = record.run.counts(n);
  json result = {{"name", record.scenario.phases[n].name},
                 {"frames", record.scenario.phases[n].frames},
                 {"held", counts.held},
                 {"pinned", counts.pinned},
                 {"moved", counts.moved},
                 {"pulled", counts.with_force},
                 {"steps", phase.steps},
                 {"motion_mm", phase.last.motion_mm},
                 {"settled", phase.unsettled == 0},
                 {"frames_not_settled", phase.unsettled},
                 {"largest_displacement_mm", phase.largest_mm}};
  if (record.scenario.method == Method::chainmail) {
    result["links_beyond_limits"] = links_json(record, phase.broken);
  } else {
    result["residual"] = phase.last.residual;
    result["energy_n_mm"] = phase.energy_n_mm;
  }
  return result;
}

std::string phase_name(const SimulateRecord& record, std::size_t n) {
  return record.scenario.phases.size() == 1 ? "" : "in phase \"" + record.scenario.phases[n].name + "\" ";
}

}  // namespace

const char* name_of(Method method) { return method == Method::chainmail ? "chainmail" : "mass-spring"; }

void add_frame(SimulateRecord& record, const FrameResult& frame, std::span<const glm::vec3> displacement) {
  record.phases.resize(std::max(record.phases.size(), frame.phase + 1));
  PhaseRecord& phase = record.phases[frame.phase];
  phase.steps += frame.convergence.steps;
  phase.unsettled += !frame.convergence.reached;
  phase.last = frame.convergence;
  if (!frame.ends_phase) return;
  for (const glm::vec3& by : displacement) phase.largest_mm = std::max(phase.largest_mm, glm::length(glm::dvec3(by)));
  if (record.scenario.method == Method::chainmail) {
    phase.broken = links_beyond_limits(record.run.model(), displacement, kLimitToleranceMm);
  } else {
    phase.energy_n_mm = energy(record.run.model(), displacement);
  }
}

json document_of(const SimulateRecord& record) {
  json document = provenance("simulate");
  const SimulateOptions& options = record.options;
  document["scenario"] = {
      {"path", options.scenario.string()}, {"name", record.scenario.name}, {"sha256", hash_file(options.scenario)}};
  document["input"] = options.input.path.string();
  document["labels"] = options.labels.empty() ? json() : json(options.labels.string());
  document["output"] = options.output.string();
  document["method"] = name_of(record.scenario.method);
  document["method_version"] = version_of(record.scenario.method);
  document["backend"] = record.backend;
  document["cell_size"] = record.scenario.cell_size;
  document["lattice"] = to_json(record.patient.lattice);
  document["body_box_lps_mm"] = json();
  if (const auto& box = record.patient.box) document["body_box_lps_mm"] = {list_of(box->low), list_of(box->high)};
  document["tissues"] = tissues_json(record);
  const StoppingRule& stop = record.scenario.stop;
  document["stop"] = {{"motion_mm", stop.motion_mm}, {"residual", stop.residual}, {"steps", stop.steps}};
  document["deadband_mm"] = record.scenario.deadband_mm;
  document["phases"] = json::array();
  for (std::size_t n = 0; n < record.phases.size(); ++n) document["phases"].push_back(phase_json(record, n));
  for (const auto& [name, seconds] : record.stages) document["stages"][name] = {{"seconds", seconds}};
  return document;
}

std::vector<std::string> warnings_of(const SimulateRecord& record) {
  constexpr std::size_t kTold = 5;  // what a hand did has many phases, of few steps a frame
  std::vector<std::string> warnings = record.run.notes();
  std::size_t unsettled = 0;
  for (std::size_t n = 0; n < record.phases.size(); ++n) {
    const PhaseRecord& phase = record.phases[n];
    if (phase.unsettled > 0 && ++unsettled <= kTold) {
      char text[160];
      std::snprintf(text, sizeof text, "%d of %d frames had not settled after %d steps (last motion %.3g mm%s)",
                    phase.unsettled, record.scenario.phases[n].frames, record.scenario.stop.steps, phase.last.motion_mm,
                    record.scenario.method == Method::mass_spring
                        ? (", residual " + json(phase.last.residual).dump()).c_str()
                        : "");
      warnings.push_back(phase_name(record, n) + text + "; give more steps, or a smaller motion");
    }
    if (!phase.broken.empty()) {
      warnings.push_back(phase_name(record, n) + std::to_string(phase.broken.size()) +
                         " links are beyond their limits, where what is held and what is moved allow nothing else");
    }
  }
  if (unsettled > kTold)
    warnings.push_back("as many as " + std::to_string(unsettled - kTold) + " further phases had such frames");
  return warnings;
}

std::string describe(const SimulateRecord& record) {
  const ScenarioRun& run = record.run;
  std::string tissues;
  for (std::size_t n = 0; n < record.scenario.tissues.size(); ++n) {
    tissues += (n > 0 ? ", " : "") + record.scenario.tissues[n].tissue.name + " " +
               std::to_string(cells_of(record, n)) + " cells";
  }
  std::string text = std::string(name_of(record.scenario.method)) + " on the " + record.backend + ", " +
                     to_string(record.patient.lattice.size) + " vertices, " + std::to_string(run.frames()) +
                     (run.frames() == 1 ? " frame" : " frames") + "; " + tissues;
  constexpr std::size_t kTold = 20;
  const std::size_t phases = record.scenario.phases.size();
  for (std::size_t n = 0; n < std::min(phases, kTold); ++n) {
    const PhaseCounts& counts = run.counts(n);
    text += "; " + phase_name(record, n) + std::to_string(counts.held) + " vertices held, " +
            (counts.pinned > 0 ? std::to_string(counts.pinned) + " pinned, " : "") + std::to_string(counts.moved) +
            " moved, " + std::to_string(counts.with_force) + " pulled";
  }
  if (phases > kTold) text += "; and " + std::to_string(phases - kTold) + " further phases";
  return text;
}

}  // namespace tetwarp::apps
