// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/lattice.cuh"

namespace tetwarp::cuda_detail {

/// What one pass over a field whose undeformed vertices lie at whole steps reads and writes.
struct StepPass {
  LatticeFrame frame;
  StepLattice lattice;            ///< without `packed`
  const glm::vec3* displacement;  ///< mm
  std::uint64_t* packed;          ///< gets the packed vertices of the lattice; null: not filled
  InvertedPairs inverted;         ///< all zero before the pass
  MovingBlocks moving;            ///< all zero before the pass
  LatticeFindings* found;
  bool wants_range;  ///< whether the range of Jacobian determinants is found; their signs always are
};

/// Reads every displacement once: snaps it, takes the Jacobian determinants of all tetrahedra, and notes what is
/// inverted and what moves.
void run_step_pass(const StepPass& pass, cudaStream_t stream);

/// Packs the vertices of a lattice that `run_step_pass` has looked at into where their displacements are.
void pack_in_place(const StepPass& pass, cudaStream_t stream);

/// Finds the least and the most that vertices move along i, j, k, 2^-12 voxel.
/// @param low_high  low and high of each axis, widened by what is found
void find_range(const StepPass& pass, int* low_high, cudaStream_t stream);

}  // namespace tetwarp::cuda_detail
