// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "deform/resampler.h"
#include "deform/simulate/simulation.h"

namespace tetwarp::simulate {

/// How the global step of the CPU solves with the Laplacian of the springs.
struct MassSpringOptions {
  enum class Solver : std::uint8_t {
    automatic,  ///< Cholesky up to kMostNodesForCholesky nodes, conjugate gradients above
    cholesky,   ///< factored once for each set of placed nodes: its fill grows as nodes^(4/3)
    pcg,        ///< conjugate gradients, matrix-free
  };
  Solver solver = Solver::automatic;
};
inline constexpr std::size_t kMostNodesForCholesky = 20'000;

/// Springs along all links of a model, at rest where nothing moved; quasi-static: every call of `advance` goes to a
/// minimum of the energy, and mass and time play no part.
///
/// Where placed nodes moved, the others first follow: by the rigid motion closest to that of the placed ones, where it
/// leaves less than a quarter of the squares of their ways (rigid_motion), and for the rest by the harmonic extension.
/// Then come local/global steps (Liu, Bargteil, O'Brien and Kavan 2013: springs choose their directions, then one
/// linear system with a constant Laplacian) while they are worth it, and Newton's steps with conjugate gradients from
/// there on. A line search keeps the energy falling in every step. A step is one linear system. See
/// docs/design/simulation.md.
///
/// Nodes that springs do not tie to a placed node stay where they are, whatever the force on them.
///
/// @param model  must outlive the simulation and stay as it is
/// @throws InputError for a model whose arrays do not fit each other. The simulation's set_loads refuses forces where
/// no node is placed
std::unique_ptr<Simulation> make_cpu_mass_spring(const Model& model, const MassSpringOptions& options = {},
                                                 Limits limits = {});

/// The same on a CUDA device, always with conjugate gradients; displacements stay in device memory.
/// @throws DeviceError without a device, NotCompiled in a build without CUDA
std::unique_ptr<Simulation> make_cuda_mass_spring(const Model& model, const MassSpringOptions& options = {},
                                                  int device = 0);

/// Energy of the springs of displaced nodes (LPS mm), N mm: the sum of k/2 (length - rest length)^2.
double energy(const Model& model, std::span<const glm::vec3> displacement);
/// Force of the springs on each node, N, LPS.
std::vector<glm::dvec3> net_forces(const Model& model, std::span<const glm::vec3> displacement);

}  // namespace tetwarp::simulate
