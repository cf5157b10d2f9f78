// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/scenario_run.h"

#include <algorithm>

#include "deform/errors.h"
#include "deform/simulate/cuts/cut_surface.h"

namespace tetwarp::simulate {

ScenarioRun::ScenarioRun(const Scenario& scenario, const Patient& patient, MakeSimulation make)
    : scenario_(scenario), player_(scenario, patient, std::move(make)) {
  for (const Phase& phase : scenario.phases) {
    const PhaseLoads loads(scenario, phase, patient);
    counts_.push_back(loads.counts());
    for (const std::string& note : loads.notes())
      if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) notes_.push_back(note);
    for (const Cut& cut : open_cuts(scenario, phase, patient)) CutSurface{cut};  // throws for a cut that is none
  }
}

int ScenarioRun::frames() const { return frame_count(scenario_); }

FrameResult ScenarioRun::next(const Control& control) {
  require(!is_done(), "the scenario has no further frame");
  const Phase& phase = scenario_.phases[phase_];
  if (!has_begun_) player_.begin(phase);
  has_begun_ = true;
  FrameResult frame{.number = done_ + 1, .phase = phase_, .convergence = player_.next(control)};
  ++done_;
  frame.ends_phase = player_.frames_done() == phase.frames;
  if (frame.ends_phase) {
    ++phase_;
    has_begun_ = false;
  }
  return frame;
}

Report ScenarioRun::resample(ForwardResampler& resampler, std::span<const Target> targets, Outside outside,
                             const Maps& maps, const FieldOptions& options, const Control& control) {
  require(player_.simulation() != nullptr, "a scenario has a field after its first frame");
  if (!divides_cells()) {
    resampler.set_field(simulate::view(*player_.simulation(), player_.model(), outside), options, control);
  } else {
    field_ = field();
    resampler.set_field(tetwarp::view(field_, outside), options, control);
  }
  return resampler.resample(whole(resampler.output()), targets, maps, control);
}

}  // namespace tetwarp::simulate
