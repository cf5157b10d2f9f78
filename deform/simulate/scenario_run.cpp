// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/scenario_run.h"

#include <algorithm>

#include "deform/errors.h"
#include "deform/simulate/cuts/cut_surface.h"

namespace tetwarp::simulate {

namespace {

std::vector<std::string> sorted(std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

}  // namespace

ScenarioRun::ScenarioRun(const Scenario& scenario, const Patient& patient, MakeSimulation make)
    : scenario_(scenario),
      patient_(patient),
      make_(std::move(make)),
      tissue_of_cell_(tissue_of_cells(scenario, patient)) {
  for (const Phase& phase : scenario.phases) {
    const PhaseLoads loads(scenario, phase, patient);
    counts_.push_back(loads.counts());
    for (const std::string& note : loads.notes())
      if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) notes_.push_back(note);
    for (const Cut& cut : open_cuts(scenario, phase, patient)) CutSurface{cut};  // throws for a cut that is none
  }
  make_model_of(scenario.phases.front());
}

int ScenarioRun::frames() const { return frame_count(scenario_); }

void ScenarioRun::make_model_of(const Phase& phase) {
  std::vector<Tissue> tissues;
  for (const TissueClass& one : scenario_.tissues) tissues.push_back(one.tissue);
  const std::vector<Cut> cuts = open_cuts(scenario_, phase, patient_);
  division_ = cuts.empty() ? DividedLattice{} : divide(patient_.lattice, cuts);
  model_ = make_model(patient_.lattice, tissue_of_cell_, tissues, division_.copies_of, division_.pieces);
}

VertexField ScenarioRun::field() const { return field_of(patient_.lattice, division_, displacement()); }

std::vector<glm::vec3> ScenarioRun::displacement() const {
  return simulation_ ? simulation_->displacement_on_host() : std::vector<glm::vec3>(model_.nodes());
}

/// Makes the model anew for the open cuts of a phase, and `start_` with it: vertices start where they are, copies where
/// the tissue was to which they belong.
void ScenarioRun::carry_over_to(const Phase& phase) {
  const DividedLattice before = std::move(division_);
  make_model_of(phase);
  std::vector<glm::vec3> carried(start_.begin(), start_.begin() + voxel_count(patient_.lattice));
  for (const std::uint32_t node : nodes_before(division_, before, patient_.lattice)) carried.push_back(start_[node]);
  start_ = std::move(carried);
}

void ScenarioRun::begin_phase() {
  const Phase& phase = scenario_.phases[phase_];
  start_ = displacement();
  const bool other_cuts = phase_ > 0 && sorted(phase.closed_cuts) != sorted(scenario_.phases[phase_ - 1].closed_cuts);
  if (!simulation_ || other_cuts) {
    simulation_.reset();
    if (other_cuts) carry_over_to(phase);  // for the first phase there is a model already
    simulation_ = make_(model_);
    simulation_->set_displacement(start_);
  }
  loads_.emplace(scenario_, phase, patient_);
  if (!loads_->changes_by_frame()) simulation_->set_loads(loads_->at(1, model_, start_));
}

FrameResult ScenarioRun::next(const Control& control) {
  require(!is_done(), "the scenario has no further frame");
  if (frame_in_phase_ == 0) begin_phase();
  const Phase& phase = scenario_.phases[phase_];
  const double part = static_cast<double>(frame_in_phase_ + 1) / phase.frames;
  FrameResult frame{.number = done_ + 1, .phase = phase_, .convergence = {}};
  simulation_->set_deadband(frame_in_phase_ + 1 == phase.frames ? 0 : scenario_.deadband_mm);
  if (loads_->changes_by_frame()) {
    const std::vector<glm::vec3> now = loads_->pushes() ? displacement() : std::vector<glm::vec3>{};
    simulation_->set_loads(loads_->at(part, model_, start_, now));
    frame.convergence = simulation_->advance(1, scenario_.stop, control);
  } else {
    frame.convergence = simulation_->advance(part, scenario_.stop, control);
  }
  ++done_;
  frame.ends_phase = ++frame_in_phase_ == phase.frames;
  if (frame.ends_phase) {
    ++phase_;
    frame_in_phase_ = 0;
  }
  return frame;
}

Report ScenarioRun::resample(ForwardResampler& resampler, std::span<const Target> targets, Outside outside,
                             const Maps& maps, const FieldOptions& options, const Control& control) {
  require(simulation_ != nullptr, "a scenario has a field after its first frame");
  if (!divides_cells()) {
    resampler.set_field(simulate::view(*simulation_, model_, outside), options, control);
  } else {
    field_ = field();
    resampler.set_field(tetwarp::view(field_, outside), options, control);
  }
  return resampler.resample(whole(resampler.output()), targets, maps, control);
}

}  // namespace tetwarp::simulate
