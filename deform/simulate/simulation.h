// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "deform/resampler.h"
#include "deform/simulate/model.h"

namespace tetwarp::simulate {

enum class Hold : std::uint8_t {
  free,    ///< goes where its links and the force on it take it
  placed,  ///< goes to its goal: held tissue, whose goal is where it rests, and handles
};

/// What is done to the nodes of a model; each array has one entry a node.
struct Loads {
  std::vector<Hold> hold;
  std::vector<glm::vec3> goal;   ///< LPS mm, displacement of placed nodes; of free ones not looked at
  std::vector<glm::vec3> force;  ///< N, LPS, on free nodes; empty: none. Chainmail knows no forces
};

/// When a simulation has settled: both hold, or the steps are spent.
struct StoppingRule {
  double motion_mm = 0.01;  ///< largest motion of a node in the last step
  double residual = 1e-3;   ///< see Settled::residual
  int steps = 2000;
};

struct Settled {
  int steps = 0;         ///< that were made
  double motion_mm = 0;  ///< largest motion of a node in the last
  /// Mass-spring: largest net force on a free node, over the largest force by which placed nodes are kept in their
  /// places or loads pull (0 where there is none). Chainmail has no forces: 0.
  double residual = 0;
  bool reached = false;  ///< the rule was met
};

/// Moves the nodes of one model; a backend of its own for each method. One object is for one thread at a time.
///
/// The result is a function of model, loads and rule alone; it does not depend on threads. Chainmail gives the same
/// bits on every backend, mass-spring the same on every run of a backend.
class Simulation {
 public:
  virtual ~Simulation() = default;

  /// What the next calls of `advance` lead to; placed nodes start from where they are now, forces from what they are
  /// now. @throws InputError for arrays of the wrong size, a goal or force that is not finite or too large
  virtual void set_loads(const Loads& loads) = 0;

  /// Takes placed nodes and forces to `part` (0 to 1) of their way and lets the other nodes settle.
  /// @throws Cancelled, after which the displacements are those of some step
  virtual Settled advance(double part, const StoppingRule& rule, const Control& control = {}) = 0;

  /// LPS mm of every node, deformed minus rest: of the lattice's vertices first, in order. In `memory()`; changed by
  /// the next call of advance.
  virtual std::span<const glm::vec3> displacement() const = 0;
  virtual Memory memory() const { return Memory::host; }

  /// The same, copied to the host whatever the memory: those on a device override it.
  virtual std::vector<glm::vec3> displacement_on_host() const {
    const std::span<const glm::vec3> from = displacement();
    return {from.begin(), from.end()};
  }

  /// Starts from these displacements (host memory) instead. @throws InputError as set_loads
  virtual void set_displacement(std::span<const glm::vec3> displacement) = 0;
};

/// The lattice of a simulation without cuts, where it is: for Resampler::set_field.
inline FieldView view(const Simulation& simulation, const Model& model, Outside outside = Outside::refuse) {
  return {.lattice = &model.lattice,
          .displacement = simulation.displacement().data(),
          .outside = outside,
          .memory = simulation.memory()};
}

}  // namespace tetwarp::simulate
