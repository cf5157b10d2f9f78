// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/phase_player.h"

#include "deform/errors.h"

namespace tetwarp::simulate {

PhasePlayer::PhasePlayer(const Scenario& scenario, const Patient& patient, MakeSimulation make)
    : scenario_(scenario),
      patient_(patient),
      make_(std::move(make)),
      tissue_of_cell_(tissue_of_cells(scenario, patient)) {
  for (const Phase& phase : scenario.phases)
    for (const Move& move : phase.moves) has_forces_ = has_forces_ || std::holds_alternative<Force>(move.how);
  Phase first;  // so that there is a model before anything begins
  for (const CutPlan& cut : scenario.cuts) first.closed_cuts.push_back(cut.name);
  make_model(open_in(scenario.phases.empty() ? first : scenario.phases.front()));
}

std::set<std::string> PhasePlayer::open_in(const Phase& phase) const {
  std::set<std::string> open;
  for (const CutPlan& cut : scenario_.cuts)
    if (is_open(cut, phase)) open.insert(cut.name);
  return open;
}

void PhasePlayer::make_model(const std::set<std::string>& open) {
  Phase phase;
  for (const CutPlan& cut : scenario_.cuts)
    if (open.count(cut.name) == 0) phase.closed_cuts.push_back(cut.name);
  std::vector<Tissue> tissues;
  for (const TissueClass& one : scenario_.tissues) tissues.push_back(one.tissue);
  const std::vector<Cut> cuts = open_cuts(scenario_, phase, patient_);
  DividedLattice division = cuts.empty() ? DividedLattice{} : divide(patient_.lattice, cuts);
  Model model = simulate::make_model(patient_.lattice, tissue_of_cell_, tissues, division.copies_of, division.pieces);
  simulation_.reset();  // it refers to the model
  division_ = std::move(division);
  model_ = std::move(model);
  open_ = open;
}

VertexField PhasePlayer::field() const { return field_of(patient_.lattice, division_, displacement()); }

std::vector<glm::vec3> PhasePlayer::displacement() const {
  return simulation_ ? simulation_->displacement_on_host() : std::vector<glm::vec3>(model_.nodes());
}

void PhasePlayer::begin(const Phase& phase) {
  PhaseLoads loads(scenario_, phase, patient_);  // throws before anything has changed
  const std::set<std::string> open = open_in(phase);
  start_ = displacement();
  if (!simulation_ || open != open_) {
    if (open != open_) {  // vertices start where they are, copies where the tissue was to which they belong
      const DividedLattice before = division_;
      make_model(open);
      std::vector<glm::vec3> carried(start_.begin(), start_.begin() + voxel_count(patient_.lattice));
      for (const std::uint32_t node : nodes_before(division_, before, patient_.lattice))
        carried.push_back(start_[node]);
      start_ = std::move(carried);
    }
    simulation_ = make_(model_);
    simulation_->set_displacement(start_);
  }
  loads_.emplace(std::move(loads));
  frames_ = phase.frames;
  frame_ = 0;
  if (!loads_->changes_by_frame()) simulation_->set_loads(loads_->at(1, model_, start_));
}

void PhasePlayer::extend(std::span<const glm::dvec3> drags, const std::optional<glm::dvec3>& ball) {
  require(loads_.has_value(), "no phase has begun that could have a further frame");
  loads_->extend(drags, ball);
  ++frames_;
}

Convergence PhasePlayer::next(const Control& control) {
  require(loads_.has_value() && frame_ < frames_, "the phase has no further frame");
  // Where nothing is on its way, and no force is let go of, all frames are alike, however many follow.
  const double part = loads_->is_still() && !has_forces_ ? 1 : static_cast<double>(frame_ + 1) / frames_;
  simulation_->set_deadband(frame_ + 1 == frames_ ? 0 : scenario_.deadband_mm);
  const bool changes = loads_->changes_by_frame();
  if (changes && loads_->changes_in(frame_)) {
    const std::vector<glm::vec3> now = loads_->pushes() ? displacement() : std::vector<glm::vec3>{};
    simulation_->set_loads(loads_->at(part, model_, start_, now));
  }
  const Convergence convergence = simulation_->advance(changes ? 1 : part, scenario_.stop, control);
  ++frame_;
  return convergence;
}

PhasePlayer::State PhasePlayer::state() const {
  return {open_, simulation_ ? simulation_->state() : std::vector<std::byte>{}};
}

void PhasePlayer::set_state(const State& state) {
  loads_.reset();
  if (state.open != open_) make_model(state.open);
  if (state.of_nodes.empty()) return simulation_.reset();
  if (!simulation_) simulation_ = make_(model_);
  simulation_->set_state(state.of_nodes);
}

}  // namespace tetwarp::simulate
