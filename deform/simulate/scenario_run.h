// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "deform/simulate/divided_lattice.h"
#include "deform/simulate/scenario.h"

namespace tetwarp::simulate {

/// How a scenario is simulated, and where: one of the factories of a method.
using MakeSimulation = std::function<std::unique_ptr<Simulation>(const Model&)>;

/// What became of a frame.
struct Frame {
  int number = 0;         ///< from 1, over all phases
  std::size_t phase = 0;  ///< from 0
  bool ends_phase = false;
  Settled settled;
};

/// A scenario that is played on a patient, frame by frame.
///
/// Where other cuts are open than in the phase before, the model is made anew: vertices keep their places, and copies
/// that a cut needs begin where the tissue was that they belong to (`nodes_before`). So a cut that stays open stays as
/// wide as it is while another is made or closed.
class ScenarioRun {
 public:
  /// Refers to the scenario and the patient. @throws InputError for a scenario that cannot be played on this patient,
  /// of any phase: before anything is simulated
  ScenarioRun(const Scenario& scenario, const Patient& patient, MakeSimulation make);
  ScenarioRun(const ScenarioRun&) = delete;
  ScenarioRun& operator=(const ScenarioRun&) = delete;

  int frames() const;
  bool is_done() const { return done_ == frames(); }
  /// Simulates the next frame. @throws Cancelled, and what the simulation throws
  Frame next(const Control& control = {});

  /// Sends volumes through the field as it is after the last frame: with `next` in turn, the loop of an interactive
  /// program. Where the simulation keeps displacements on a device they stay there, unless open cuts divide cells;
  /// nothing is allocated a frame once sizes repeat. @throws as Resampler does
  Report resample(Resampler& resampler, std::span<const Target> targets, Outside outside = Outside::background,
                  const Maps& maps = {}, const Control& control = {});

  const PhaseLoads& loads(std::size_t phase) const { return loads_[phase]; }
  const std::vector<std::uint8_t>& tissues() const { return tissue_of_cell_; }  ///< of each cell
  const Model& model() const { return model_; }                                 ///< of the last frame's phase
  const Simulation& simulation() const { return *simulation_; }                 ///< after the last frame
  /// LPS mm of each node of the model, in host memory; at rest before the first frame.
  std::vector<glm::vec3> displacement() const;
  /// As it is after the last frame: cells that open cuts divide are replaced by a mesh.
  VertexField field() const;

 private:
  void begin_phase();
  void carry_over_to(const Phase& phase);
  void make_model_of(const Phase& phase);

  const Scenario& scenario_;
  const Patient& patient_;
  MakeSimulation make_;
  std::vector<std::uint8_t> tissue_of_cell_;
  std::vector<PhaseLoads> loads_;
  DividedLattice division_;  ///< by the cuts that are open
  Model model_;
  std::unique_ptr<Simulation> simulation_;
  std::vector<glm::vec3> start_;  ///< displacements when the phase began
  VertexField field_;             ///< that the resampler of the last frame looks at, with open cuts
  std::size_t phase_ = 0;
  int frame_in_phase_ = 0, done_ = 0;
};

}  // namespace tetwarp::simulate
