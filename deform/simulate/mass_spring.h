// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "deform/resampler.h"
#include "deform/simulate/simulation.h"

namespace tetwarp::simulate {

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
/// Every run gives the same bits, for any number of threads and on every backend.
///
/// @param model   nodes, links and their moduli (model.h); must outlive the simulation unchanged
/// @param limits  number of threads
/// @throws InputError for a model whose arrays do not fit each other. The simulation's `set_loads` refuses forces where
///         no node is placed.
std::unique_ptr<Simulation> make_cpu_mass_spring(const Model& model, Limits limits = {});

/// Energy of the springs, N mm: the sum of k/2 (length - rest length)^2 over all springs.
/// @param model         model whose springs are summed
/// @param displacement  LPS mm of each node
double energy(const Model& model, std::span<const glm::vec3> displacement);
/// Force of the springs on each node of the model, in their order: N, LPS, the way in which the springs move the node.
/// @param model         model with the springs
/// @param displacement  LPS mm of each node
std::vector<glm::dvec3> net_forces(const Model& model, std::span<const glm::vec3> displacement);

}  // namespace tetwarp::simulate
