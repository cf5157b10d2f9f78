// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <string>
#include <vector>

#include "deform/simulate/phase_player.h"

namespace tetwarp::simulate {

/// What became of a frame.
struct FrameResult {
  int number = 0;           ///< from 1, counted over all phases
  std::size_t phase = 0;    ///< index of its phase
  bool ends_phase = false;  ///< whether it is the last frame of its phase
  Convergence convergence;  ///< how the simulation converged
};

/// A scenario that is played on a patient, frame by frame (`PhasePlayer`).
class ScenarioRun {
 public:
  /// Checks all phases before anything is simulated. Scenario and patient must outlive this object.
  /// @throws InputError for a scenario that cannot be played on this patient
  ScenarioRun(const Scenario& scenario, const Patient& patient, MakeSimulation make);
  ScenarioRun(const ScenarioRun&) = delete;
  ScenarioRun& operator=(const ScenarioRun&) = delete;

  /// Number of frames of all phases.
  int frames() const;
  /// Number of frames that were simulated.
  int frames_done() const { return done_; }
  /// Whether the last frame was simulated.
  bool is_done() const { return done_ == frames(); }
  /// Simulates the next frame.
  /// @throws Cancelled and whatever the simulation throws
  FrameResult next(const Control& control = {});

  /// Sends volumes through the field after the last frame. Calling this and `next` in turn is the loop of an
  /// interactive program. Displacements that the simulation keeps on a device stay there, unless open cuts divide
  /// cells. Frames of the same sizes allocate nothing.
  /// @throws InputError and others, as `ForwardResampler::set_field` and `Resampler::resample`
  Report resample(ForwardResampler& resampler, std::span<const Target> targets, Outside outside = Outside::background,
                  const Maps& maps = {}, const FieldOptions& options = {}, const Control& control = {});

  /// What a phase does, by index.
  const PhaseCounts& counts(std::size_t phase) const { return counts_[phase]; }
  /// Remarks for people on all phases, each once: such as a hold that holds no vertex.
  const std::vector<std::string>& notes() const { return notes_; }
  /// For each cell, i fastest, the index of its tissue in `Scenario::tissues`.
  const std::vector<std::uint8_t>& tissues() const { return player_.tissues(); }
  /// Whether open cuts divide cells, so that a mesh takes their place in the field.
  bool divides_cells() const { return player_.divides_cells(); }
  /// The model of the phase of the last frame.
  const Model& model() const { return player_.model(); }
  /// The simulation after the last frame.
  const Simulation& simulation() const { return *player_.simulation(); }
  /// Displacement of each node of the model, LPS mm, in host memory; 0 before the first frame.
  std::vector<glm::vec3> displacement() const { return player_.displacement(); }
  /// The field after the last frame. A mesh takes the place of cells that open cuts divide.
  VertexField field() const { return player_.field(); }

 private:
  const Scenario& scenario_;
  PhasePlayer player_;
  std::vector<PhaseCounts> counts_;  ///< of each phase
  std::vector<std::string> notes_;
  VertexField field_;  ///< field that the resampler of the last frame refers to, where cuts are open
  std::size_t phase_ = 0;
  bool has_begun_ = false;  ///< whether that phase has
  int done_ = 0;
};

}  // namespace tetwarp::simulate
