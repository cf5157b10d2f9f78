// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "deform/simulate/divided_lattice.h"
#include "deform/simulate/scenario.h"

namespace tetwarp::simulate {

/// Makes the simulation of a model: one of the factories of a method and backend.
using MakeSimulation = std::function<std::unique_ptr<Simulation>(const Model&)>;

/// Plays phases on a patient, one after the other, frame by frame: those of a scenario that is known (`ScenarioRun`),
/// or those that a hand makes up.
///
/// Where the open cuts are not those of the phase before, the model is made anew. Vertices keep their places, and
/// copies that a cut needs begin where their tissue was (`nodes_before`). So a cut that stays open keeps its width
/// while another is made or closed.
class PhasePlayer {
 public:
  /// Scenario and patient must outlive this object; of the scenario all but its phases is read, whenever a phase
  /// begins.
  /// @throws InputError for a scenario that does not suit the patient
  PhasePlayer(const Scenario& scenario, const Patient& patient, MakeSimulation make);
  PhasePlayer(const PhasePlayer&) = delete;
  PhasePlayer& operator=(const PhasePlayer&) = delete;

  /// Begins a phase where the one before led.
  /// @throws InputError for a phase that cannot be played
  void begin(const Phase& phase);
  /// Gives the phase one more frame. Only for a phase in which all moves are drags, or nothing moves: the next place of
  /// each drag, in the order of the moves, and of the ball.
  void extend(std::span<const glm::dvec3> drags, const std::optional<glm::dvec3>& ball);
  /// Simulates the next frame of the phase.
  /// @throws Cancelled and whatever the simulation throws
  Convergence next(const Control& control = {});
  /// Number of frames of the phase that were simulated.
  int frames_done() const { return frame_; }

  /// What a state depends on: of the simulation, and which cuts are open.
  struct State {
    std::set<std::string> open;       ///< names of the open cuts
    std::vector<std::byte> of_nodes;  ///< `Simulation::state`; empty before the first phase
  };
  /// The state that another player, on any backend, can go on from.
  State state() const;
  /// Goes on from a state, to the same bits. A phase begins next.
  void set_state(const State& state);

  /// For each cell, i fastest, the index of its tissue in `Scenario::tissues`.
  const std::vector<std::uint8_t>& tissues() const { return tissue_of_cell_; }
  /// What the phase does.
  const PhaseLoads& loads() const { return *loads_; }
  /// Whether open cuts divide cells, so that a mesh takes their place in the field.
  bool divides_cells() const { return !division_.replaced.empty(); }
  /// The mesh in the place of the cells that open cuts divide.
  const DividedLattice& division() const { return division_; }
  /// The model of the phase.
  const Model& model() const { return model_; }
  /// Null before the first phase.
  Simulation* simulation() const { return simulation_.get(); }
  /// Displacement of each node of the model, LPS mm, in host memory; 0 before the first frame.
  std::vector<glm::vec3> displacement() const;
  /// The field now. A mesh takes the place of cells that open cuts divide.
  VertexField field() const;

 private:
  std::set<std::string> open_in(const Phase& phase) const;
  void make_model(const std::set<std::string>& open);

  const Scenario& scenario_;
  const Patient& patient_;
  MakeSimulation make_;
  std::vector<std::uint8_t> tissue_of_cell_;
  DividedLattice division_;  ///< the lattice as the open cuts divide it
  Model model_;
  bool has_forces_ = false;     ///< whether the scenario has, in any phase
  std::set<std::string> open_;  ///< names of the cuts for which the model was made
  std::unique_ptr<Simulation> simulation_;
  std::vector<glm::vec3> start_;     ///< displacement of each node when the phase began, LPS mm
  std::optional<PhaseLoads> loads_;  ///< of the phase
  int frames_ = 0, frame_ = 0;       ///< of the phase: how many there are, and were simulated
};

}  // namespace tetwarp::simulate
