// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "deform/resampler.h"
#include "deform/simulate/model.h"
#include "deform/simulate/state_bytes.h"

/// Simulations that compute a field from what is done to a patient.
namespace tetwarp::simulate {

/// Who decides where a node goes.
enum class Constraint : std::uint8_t {
  free,    ///< its links and the force on it
  placed,  ///< its goal; held tissue has the goal of not moving, gripped tissue that of its handle
};

/// What is done to the nodes of a model. Each array has one entry a node.
struct Loads {
  std::vector<Constraint> constraint;  ///< free or placed
  std::vector<glm::vec3> goal;         ///< displacement of placed nodes, LPS mm; entries of free nodes are not read
  std::vector<glm::vec3> force;        ///< force on free nodes, N, LPS; empty: none. ChainMail refuses forces
};

/// When a simulation has converged: when both `motion_mm` and `residual` are reached, or all steps are done.
struct StoppingRule {
  double motion_mm = 0.01;  ///< largest motion of a node in the last step, mm
  double residual = 1e-3;   ///< largest `Convergence::residual`
  int steps = 2000;         ///< largest number of steps
};

/// How a simulation converged.
struct Convergence {
  int steps = 0;         ///< number of steps that were made
  double motion_mm = 0;  ///< largest motion of a node in the last step, mm
  /// Mass-spring: the largest net force on a free node, divided by the largest force that keeps a placed node in place
  /// or that a load exerts (0 if there is none). ChainMail has no forces: 0.
  double residual = 0;
  bool reached = false;  ///< whether motion and residual are within the rule
};

/// What is shown of a node, LPS mm.
/// @param before  displacement that was shown last
/// @param now     displacement
/// @param square  of the deadband, mm2: a node stays where it is shown unless it is farther away. 0: it never stays
TETWARP_HD inline glm::vec3 shown_of(const glm::vec3& before, const glm::vec3& now, float square) {
  const glm::vec3 way = now - before;
  return square == 0 || way.x * way.x + way.y * way.y + way.z * way.z > square ? now : before;
}

/// Moves the nodes of one model. Each method and backend has its own implementation. One object serves one thread at a
/// time.
///
/// The result depends on model, loads and rule alone, not on threads: both methods give the same bits on every backend.
class Simulation {
 public:
  /// Frees what the simulation holds; the model is not owned.
  virtual ~Simulation() = default;

  /// Sets what the next calls of `advance` lead to. Placed nodes start from their present places, forces from their
  /// present values.
  /// @throws InputError for arrays of the wrong size, or a goal or force that is not finite or too large
  virtual void set_loads(const Loads& loads) = 0;

  /// What the next calls of `advance` show of motions: nodes that are not farther than this from where `displacement`
  /// has them stay there, mm. The simulation itself goes on without it. 0, as at first: nothing is held back.
  void set_deadband(double mm) { deadband_square_ = static_cast<float>(mm * mm); }

  /// Takes placed nodes and forces to `part` (0 to 1) of their way and lets the other nodes converge.
  /// @throws Cancelled, after which the displacements are those of some step
  virtual Convergence advance(double part, const StoppingRule& rule, const Control& control = {}) = 0;

  /// Displacement of every node, LPS mm, deformed minus undeformed; the lattice's vertices come first, in order. The
  /// array lies in `memory()`, and the next call of `advance` changes it.
  virtual std::span<const glm::vec3> displacement() const = 0;
  /// Where `displacement` lies.
  virtual Memory memory() const { return Memory::host; }

  /// A copy of `displacement` in host memory. Simulations on a device override it.
  virtual std::vector<glm::vec3> displacement_on_host() const {
    const std::span<const glm::vec3> from = displacement();
    return {from.begin(), from.end()};
  }

  /// Starts from these displacements, LPS mm, in host memory.
  /// @throws InputError for an array of the wrong size, or numbers that are not finite or too large
  virtual void set_displacement(std::span<const glm::vec3> displacement) = 0;

  /// All that later calls depend on besides model, loads and rules, in host memory. It is more than `displacement`: a
  /// method computes with more digits, and its nodes may lag behind placed ones that are shown at their goals. The same
  /// bytes on every backend.
  virtual std::vector<std::byte> state() const {
    std::vector<std::byte> bytes;
    put_bytes(bytes, std::span<const glm::vec3>(displacement_on_host()));
    return bytes;
  }
  /// Goes on from a state of a simulation of the same model and method, to the same bits. Loads must be set anew.
  /// @throws InputError for a state of another size
  virtual void set_state(std::span<const std::byte> state) {
    const std::size_t nodes = displacement().size();
    set_displacement(StateBytes(state, nodes * sizeof(glm::vec3)).take<glm::vec3>(nodes));
  }

 protected:
  /// For `shown_of`.
  float deadband_square() const { return deadband_square_; }

 private:
  float deadband_square_ = 0;
};

/// A copy of displacements, which no simulation changes, in the memory of a backend.
class DisplacementCopy {
 public:
  virtual ~DisplacementCopy() = default;
  /// Copies displacements; done when it returns.
  /// @param displacement  what `Simulation::displacement` gives, in the same kind of memory
  /// @param stream        see Control::stream
  virtual void take(std::span<const glm::vec3> displacement, void* stream = nullptr) = 0;
  /// LPS mm of every node, in `memory()`.
  virtual std::span<glm::vec3> values() = 0;
  /// Where the values lie.
  virtual Memory memory() const = 0;
  /// A copy in host memory.
  virtual std::vector<glm::vec3> on_host() const = 0;
};

/// The displaced lattice of a simulation without cuts, in place, for `ForwardResampler::set_field`.
inline FieldView view(const Simulation& simulation, const Model& model, Outside outside = Outside::refuse) {
  return {.lattice = &model.lattice,
          .displacement = simulation.displacement().data(),
          .outside = outside,
          .memory = simulation.memory()};
}

}  // namespace tetwarp::simulate
