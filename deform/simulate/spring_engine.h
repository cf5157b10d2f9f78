// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <stop_token>

#include "deform/simulate/mass_spring.h"
#include "deform/simulate/rigid_motion.h"
#include "deform/simulate/spring_roles.h"
#include "deform/simulate/spring_step.h"

namespace tetwarp::simulate {

/// What springs and loads come to at some displacement.
struct Strain {
  double energy = 0;        ///< N mm, of springs less the work of the loads
  double free_force = 0;    ///< N, largest net force on a free node
  double placed_force = 0;  ///< N, largest by which a placed node is kept in its place
  double slope = 0;         ///< N mm: minus the net forces on free nodes times the direction (see SpringEngine::solve)
};

/// When conjugate gradients stop.
///
/// After n iterations that lowered the quadratic model by Q altogether, the last by q: where n q <= share Q (Nash and
/// Sofer 1990, "Assessing a search direction within a truncated-Newton method"). Residuals say little here: those of
/// stiff springs hide what is left to do in soft tissue.
struct Effort {
  double share = 0.1;
  int least = 3, most = 3000;

  TETWARP_HD bool is_enough(int iterations, double last_gain, double gained) const {
    return iterations >= least && iterations * last_gain <= share * gained;
  }
};

/// Squared residuals of conjugate gradients in float, over the first, that tell nothing more.
inline constexpr double kFloatRounding = 1e-12;

/// A direction that was found.
struct Solved {
  int iterations = 0;
  bool is_indefinite = false;  ///< the matrix has a direction of negative curvature: the one found is of no use
  double slope = 0;            ///< as Strain::slope, at the displacement where the system was set up
  double longest_mm = 0;       ///< of its entries
};

/// What the steps of mass-spring are made of: one for each backend. It keeps displacements in double: forces of
/// springs that hardly stretch are not to be had from floats.
class SpringEngine {
 public:
  virtual ~SpringEngine() = default;

  /// A stream of the device (`Control::stream`) on which the next calls queue their work; null: the default stream.
  virtual void set_stream(void*) {}

  /// From here on: placed nodes go from where they are to `loads.goal`, forces from what they are to `loads.force`.
  virtual void set_loads(const Loads& loads, std::span<const Role> roles) = 0;
  virtual void set_displacement(std::span<const glm::vec3> displacement) = 0;

  /// Takes forces to a part of their way. @return how placed nodes have to go for theirs
  virtual Ways aim(double part) = 0;
  /// Moves free and placed nodes from where they are; the latter still have to go where `aim` wants them.
  virtual void carry(const RigidMotion& motion) = 0;
  /// Takes placed nodes to where `aim` wants them, and free ones by the harmonic extension of that: the Laplacian of
  /// what they do is 0.
  virtual void follow(const Effort& effort, std::stop_token stop) = 0;

  /// Seeks the direction A^-1 f for the net forces f on free nodes, with A of some kind, where the nodes are.
  /// Conjugate gradients that a stop ends early still give a direction along which the energy falls.
  virtual Solved solve(Stiffness kind, const Effort& effort, std::stop_token stop) = 0;

  /// At the displacement plus `part` of the direction; first of all calls, with 0, after `aim`.
  virtual Strain try_step(double part) = 0;
  /// Goes where the last call of try_step looked.
  virtual void accept() = 0;
  /// Makes `shown` what the displacement is.
  virtual void show() = 0;
  virtual std::span<const glm::vec3> shown() const = 0;
  /// The same, copied to the host.
  virtual std::vector<glm::vec3> shown_on_host() {
    const std::span<const glm::vec3> from = shown();
    return {from.begin(), from.end()};
  }
  virtual Memory memory() const { return Memory::host; }
};

/// Steps over an engine.
std::unique_ptr<Simulation> make_mass_spring(const Model& model, std::unique_ptr<SpringEngine> engine);

std::unique_ptr<SpringEngine> make_cpu_springs(const Model& model, const MassSpringOptions& options, Limits limits);

}  // namespace tetwarp::simulate
