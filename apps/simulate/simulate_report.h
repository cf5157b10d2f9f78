// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/options.h"
#include "deform/simulate/chainmail.h"
#include "deform/simulate/scenario_run.h"

namespace tetwarp::apps {

/// What became of a phase.
struct PhaseRecord {
  int steps = 0;                                  ///< in all its frames
  int unsettled = 0;                              ///< frames of which the steps were spent before they had settled
  simulate::Settled last = {};                    ///< of its last frame
  double largest_mm = 0;                          ///< displacement at its end
  double energy_n_mm = 0;                         ///< of the springs at its end, mass-spring only
  std::vector<simulate::BrokenLink> broken = {};  ///< at its end, chainmail only
};

/// What is known of a run, to be said and written.
struct SimulateRecord {
  const SimulateOptions& options;
  const simulate::Scenario& scenario;
  const simulate::Patient& patient;
  const simulate::ScenarioRun& run;
  std::string backend;
  std::vector<PhaseRecord> phases = {};
  std::vector<std::pair<std::string, double>> stages = {};  ///< name and seconds
};

/// Adds a frame to its phase. @param displacement  of each node, when the frame ends its phase
void add_frame(SimulateRecord& record, const simulate::Frame& frame, std::span<const glm::vec3> displacement);

/// "chainmail", "mass-spring".
const char* name_of(simulate::Method method);

nlohmann::json document_of(const SimulateRecord& record);
/// Lines for people: holds without vertices, phases that did not settle, links beyond their limits.
std::vector<std::string> warnings_of(const SimulateRecord& record);
/// One line: what would be simulated.
std::string describe(const SimulateRecord& record);

}  // namespace tetwarp::apps
