#pragma once

#include "cuda/lattice.h"

namespace tetwarp::cuda_detail {

/// What one pass over a field whose vertices rest at whole steps reads and writes.
struct StepPass {
  LatticeFrame frame;
  StepLattice lattice;            ///< without `moved`
  const glm::vec3* displacement;  ///< mm
  glm::vec3* moved;               ///< snapped, 2^-12 voxel; null: not wanted
  InvertedPairs inverted;
  MovingBlocks moving;  ///< zero before
  LatticeFindings* found;
  bool wants_range;  ///< of the Jacobian determinants; their signs are always known
};

/// Reads every displacement once: snaps it, takes the Jacobian determinants of all tetrahedra, and notes what is
/// inverted and what moves.
void run_step_pass(const StepPass& pass, cudaStream_t stream);

/// Snaps alone; `moved` may be where the displacements are.
void snap_steps(const StepPass& pass, cudaStream_t stream);

}  // namespace tetwarp::cuda_detail
