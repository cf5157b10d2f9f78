// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/lattice.h"

namespace tetwarp::cuda_detail {

/// What one pass over a field whose vertices rest at whole steps reads and writes.
struct StepPass {
  LatticeFrame frame;
  StepLattice lattice;            ///< without `packed`
  const glm::vec3* displacement;  ///< mm
  std::uint64_t* packed;          ///< for the lattice; null: not wanted
  InvertedPairs inverted;         ///< zero before
  MovingBlocks moving;            ///< zero before
  LatticeFindings* found;
  bool wants_range;  ///< of the Jacobian determinants; their signs are always known
};

/// Reads every displacement once: snaps it, takes the Jacobian determinants of all tetrahedra, and notes what is
/// inverted and what moves.
void run_step_pass(const StepPass& pass, cudaStream_t stream);

/// Packs the vertices of a lattice that `run_step_pass` has looked at into where their displacements are.
void pack_in_place(const StepPass& pass, cudaStream_t stream);

/// Least and most that vertices move along i, j, k, 2^-12 voxel. @param low_high  grown
void find_range(const StepPass& pass, int* low_high, cudaStream_t stream);

}  // namespace tetwarp::cuda_detail
