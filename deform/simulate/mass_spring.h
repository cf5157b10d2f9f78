// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "deform/resampler.h"
#include "deform/simulate/simulation.h"

namespace tetwarp::simulate {

/// How mass-spring simulations solve their linear systems.
struct MassSpringOptions {
  /// How the global step on the CPU solves with the Laplacian of the springs.
  enum class Solver : std::uint8_t {
    automatic,  ///< `cholesky` up to kMostNodesForCholesky nodes, `pcg` above
    cholesky,   ///< factored once for each set of placed nodes; memory grows as nodes^(4/3)
    pcg,        ///< preconditioned conjugate gradients, without a matrix
  };
  Solver solver = Solver::automatic;  ///< choice of the solver
};
/// Largest number of nodes for which Solver::automatic factors the matrix.
inline constexpr std::size_t kMostNodesForCholesky = 20'000;

/// Springs along all links of a model, without force where nothing has moved. The simulation is quasi-static: every
/// call of `advance` goes to a minimum of the energy; mass and time play no part.
///
/// When placed nodes have moved, the others first follow: by the rigid motion closest to that of the placed nodes, if
/// it leaves less than a quarter of their squared motion, and for the remainder by harmonic extension. Then come
/// local/global steps (Liu, Bargteil, O'Brien and Kavan 2013: springs choose their directions, then one linear system
/// with a constant Laplacian is solved) as long as they make good progress, and Newton steps with conjugate gradients
/// after that. A line search makes the energy fall in every step. docs/design/simulation.md describes the method.
///
/// Nodes that no springs tie to a placed node stay where they are, whatever force acts on them.
///
/// Every run on the CPU gives the same bits, for any number of threads; a device gives others, within the stopping
/// rule.
///
/// @param model    nodes, links and their moduli (model.h); must outlive the simulation unchanged
/// @param options  choice of the solver
/// @param limits   number of threads
/// @throws InputError for a model whose arrays do not fit each other. The simulation's `set_loads` refuses forces where
///         no node is placed.
std::unique_ptr<Simulation> make_cpu_mass_spring(const Model& model, const MassSpringOptions& options = {},
                                                 Limits limits = {});

/// Energy of the springs, N mm: the sum of k/2 (length - rest length)^2 over all springs.
/// @param model         model whose springs are summed
/// @param displacement  LPS mm of each node
double energy(const Model& model, std::span<const glm::vec3> displacement);
/// Force of the springs on each node of the model, in their order: N, LPS, the way in which the springs move the node.
/// @param model         model with the springs
/// @param displacement  LPS mm of each node
std::vector<glm::dvec3> net_forces(const Model& model, std::span<const glm::vec3> displacement);

}  // namespace tetwarp::simulate
