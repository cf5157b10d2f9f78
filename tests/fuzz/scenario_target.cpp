// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Scenarios: read, and made into what they are for a small patient.
#include <cmath>
#include <stdexcept>
#include <utility>

#include "io/scenario_file.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/input_file.h"

namespace {

using namespace tetwarp::simulate;

/// 5 x 4 x 4 vertices; a dense block in air, with labels.
const Patient& patient() {
  static const Patient made = [] {
    const tetwarp::Geometry grid = {.size = {9, 7, 7}, .spacing = {2, 2, 3}, .origin = {-7, 3, 1}};
    tetwarp::Volume<std::int16_t> ct{grid, {}};
    tetwarp::Volume<std::uint8_t> labels{grid, {}};
    for (int n = 0; n < 9 * 7 * 7; ++n) {
      ct.voxels.push_back(static_cast<std::int16_t>(n % 9 < 2 ? -1000 : n % 9 < 6 ? 40 : 700));
      labels.voxels.push_back(static_cast<std::uint8_t>(n % 9 / 3));
    }
    const tetwarp::ConstVolumeView given = view(std::as_const(labels));
    return examine(view(std::as_const(ct)), &given, 2, -400);
  }();
  return made;
}

void require_finite(const glm::vec3& v) {
  if (!(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)))
    throw std::logic_error("a goal or force is not finite");
}

void prepare(const Scenario& scenario) {
  std::vector<Tissue> tissues;
  for (const TissueClass& one : scenario.tissues) tissues.push_back(one.tissue);
  const Model model = make_model(patient().lattice, tissue_of_cells(scenario, patient()), tissues);
  const std::vector<glm::vec3> start(model.nodes());
  for (const Phase& phase : scenario.phases) {
    open_cuts(scenario, phase, patient());
    const Loads loads = PhaseLoads(scenario, phase, patient()).at(0.5, model, start, start);
    for (const glm::vec3& goal : loads.goal) require_finite(goal);
    for (const glm::vec3& force : loads.force) require_finite(force);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const InputFile file(kFuzzSuffix);
  file.fill(data, size);
  accepted([&] {
    const Scenario scenario = tetwarp::read_scenario(file.path());
    asked([&] { prepare(scenario); });
  });
  return 0;
}
