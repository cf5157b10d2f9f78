// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "deform/core/host_device.h"
#include "deform/simulate/mass_spring.h"
#include "deform/simulate/rigid_motion.h"
#include "deform/simulate/spring_roles.h"
#include "deform/simulate/spring_step.h"

namespace tetwarp::simulate {

/// What springs and loads add up to at some displacement.
struct Strain {
  double energy = 0;        ///< N mm: energy of the springs minus the work of the loads
  double free_force = 0;    ///< N: the largest net force on a free node
  double placed_force = 0;  ///< N: the largest force that keeps a placed node in its place
  double slope = 0;         ///< N mm: minus the net forces on free nodes times the direction (see SpringEngine::solve)
};

/// What a sweep over all nodes finds where a direction leads: sums, and the largest squares.
struct Sums {
  double energy = 0, slope = 0;                       ///< see Strain
  double slope_before = 0;                            ///< Strain::slope where the direction begins
  double free_force = 0, placed_force = 0, load = 0;  ///< the largest squares of forces, N^2
  double length = 0;                                  ///< the largest square of the direction's vectors, mm^2

  TETWARP_HD void add(const Sums& other) {
    energy += other.energy;
    slope += other.slope;
    slope_before += other.slope_before;
    keep(free_force, other.free_force);
    keep(placed_force, other.placed_force);
    keep(load, other.load);
    keep(length, other.length);
  }
  TETWARP_HD static void keep(double& most, double value) {
    if (value > most) most = value;
  }
  Strain strain() const {
    return {.energy = energy,
            .free_force = std::sqrt(free_force),
            .placed_force = std::sqrt(std::max(placed_force, load)),
            .slope = slope};
  }
};

/// When conjugate gradients stop: after n iterations that lowered the quadratic model by Q in all, and by q in the last
/// one, they stop if n q <= share Q (Nash and Sofer 1990, "Assessing a search direction within a truncated-Newton
/// method"). Residuals say little here: those of stiff springs hide what is left to do in soft tissue.
struct SolveEffort {
  double share = 0.1;
  int least = 3, most = 3000;

  TETWARP_HD bool is_enough(int iterations, double last_gain, double gained) const {
    return iterations >= least && iterations * last_gain <= share * gained;
  }
};

/// Conjugate gradients in float stop where the squared residual is this part of the first one: below it is rounding.
inline constexpr double kFloatRounding = 1e-12;

/// A direction that SpringEngine::solve found.
struct Solved {
  int iterations = 0;
  /// The matrix has a direction of negative curvature, and the direction found is of no use.
  bool is_indefinite = false;
  double slope = 0;       ///< Strain::slope at the displacement where the system was set up
  double longest_mm = 0;  ///< the longest of its vectors, mm
  Strain there;           ///< what SpringEngine::try_step(1) gives
};

/// The operations of which a step of mass-spring consists; SpringSolver has them for every machine. Displacements are
/// kept in double: the forces of springs that hardly stretch cannot be computed from floats.
class SpringEngine {
 public:
  virtual ~SpringEngine() = default;

  /// A stream of the device (`Control::stream`) on which the next calls queue their work; null: the default stream.
  virtual void set_stream(void* stream) = 0;

  /// Sets new loads: from now on placed nodes go from where they are to `loads.goal`, and forces from what they are to
  /// `loads.force`.
  virtual void set_loads(const Loads& loads, std::span<const SpringRole> roles) = 0;
  virtual void set_displacement(std::span<const glm::vec3> displacement) = 0;
  /// `Simulation::state`: displacements and forces in double, and what is shown.
  virtual std::vector<std::byte> state() = 0;
  virtual void set_state(std::span<const std::byte> state) = 0;

  /// Sets forces to a part of their way. @return how far placed nodes still have to go for theirs
  virtual Ways aim(double part) = 0;
  /// Moves free and placed nodes from where they are. Placed ones still have to go to where `aim` wants them.
  virtual void carry(const RigidMotion& motion) = 0;
  /// Tries to move placed nodes to where `aim` wants them, and free ones by the harmonic extension of that motion,
  /// whose Laplacian is 0.
  /// @return the strain there
  virtual Strain follow(const SolveEffort& effort, std::stop_token stop) = 0;

  /// Seeks the direction A^-1 f at the present displacement, for the net forces f on free nodes and a matrix A of some
  /// kind, and tries it. If a request to stop ends conjugate gradients early, the energy still falls along the
  /// direction they give.
  virtual Solved solve(Stiffness kind, const SolveEffort& effort, std::stop_token stop) = 0;

  /// The strain at the displacement plus `part` of the direction. After `aim` it is first called with part 0.
  virtual Strain try_step(double part) = 0;
  /// Makes the displacement that was tried last the present one.
  virtual void accept() = 0;
  /// Copies the present displacement to what `shown` returns. @param square  see `shown_of`
  virtual void show(float square) = 0;
  virtual std::span<const glm::vec3> shown() const = 0;
  /// A copy of `shown` in host memory.
  virtual std::vector<glm::vec3> shown_on_host() = 0;
  /// Where `shown` lies.
  virtual Memory memory() const = 0;
};

/// A simulation that takes its steps with an engine.
std::unique_ptr<Simulation> make_mass_spring(const Model& model, std::unique_ptr<SpringEngine> engine);

std::unique_ptr<SpringEngine> make_cpu_springs(const Model& model, Limits limits);

}  // namespace tetwarp::simulate
