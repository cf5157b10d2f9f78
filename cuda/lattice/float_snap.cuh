// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/findings.cuh"
#include "cuda/lattice/step_pass.cuh"
#include "deform/core/float_snap.h"

/// From displacements to whole steps, mostly in float. For the files that pass over a field.
namespace tetwarp::cuda_detail {

namespace {

constexpr float kMost = 1 << 23;  ///< steps that a vertex may move: all is exact in float

/// How far a vertex of the lattice moves, raised, where float does not say; what cannot be held is noted. Rarely
/// called, so kept out of loops.
__device__ __noinline__ glm::vec3 raised_slowly(const StepPass& pass, glm::vec3 displacement, int number) {
  const StepLattice& lattice = pass.lattice;
  const glm::vec3& lift = lattice.packing.lift();
  const glm::ivec3 at(number % lattice.row, number % lattice.slice / lattice.row, number / lattice.slice);
  const Vertex vertex = snapped(pass.frame, displacement, glm::i64vec3(at), number, pass.found);
  const glm::i32vec3 rest(lattice.first + glm::vec3(at) * lattice.cell), u = vertex.u;
  const glm::vec3 moved(-u);
  const bool near = fabsf(moved.x) < kMost && fabsf(moved.y) < kMost && fabsf(moved.z) < kMost;
  if (!near || vertex.deformed + u != rest) {
    pass.found->beside = 1;
    return lift;
  }
  if (lattice.packing.excess(moved + lift) != 0) pass.found->wide = 1;
  return moved + lift;
}

/// How far a vertex moves, raised.
template <bool kExact>
__device__ glm::vec3 raised_steps(const StepPass& pass, const FloatSnap& fast, const glm::vec3& displacement,
                                  int number) {
  const glm::vec3 raised = fast.raised(displacement);
  if (pass.lattice.packing.excess(raised) == 0 && (kExact || fast.is_certain(displacement, raised))) return raised;
  return raised_slowly(pass, displacement, number);
}

}  // namespace

}  // namespace tetwarp::cuda_detail
