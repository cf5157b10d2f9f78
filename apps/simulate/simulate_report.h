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

/// What came of a phase.
struct PhaseRecord {
  int steps = 0;                    ///< steps of all its frames together
  int unsettled = 0;                ///< number of frames that used up their steps before they had converged
  simulate::Convergence last = {};  ///< how its last frame converged
  double largest_mm = 0;            ///< the largest displacement of a node at its end, mm
  double energy_n_mm = 0;           ///< energy of the springs at its end, N mm; mass-spring only
  std::vector<simulate::BrokenLink> broken = {};  ///< links beyond their limits at its end; ChainMail only
};

/// What is known of a run, for its messages and its report.
struct SimulateRecord {
  const SimulateOptions& options;
  const simulate::Scenario& scenario;
  const simulate::Patient& patient;
  const simulate::ScenarioRun& run;
  std::string backend;
  std::vector<PhaseRecord> phases = {};
  std::vector<std::pair<std::string, double>> stages = {};  ///< name and seconds
};

/// Adds a frame to the record of its phase. @param displacement  of each node; given when the frame ends its phase
void add_frame(SimulateRecord& record, const simulate::FrameResult& frame, std::span<const glm::vec3> displacement);

/// The name of a method: "chainmail", "mass-spring".
const char* name_of(simulate::Method method);

nlohmann::json document_of(const SimulateRecord& record);
/// Warnings for people, a line each: holds without vertices, phases that did not converge, links beyond their limits.
std::vector<std::string> warnings_of(const SimulateRecord& record);
/// A line that says what would be simulated.
std::string describe(const SimulateRecord& record);

}  // namespace tetwarp::apps
