// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/float_snap.h"
#include "deform/core/lattice_vertex.h"
#include "deform/core/step_lattice.h"

namespace tetwarp::cpu {

/// A field in the form that vector code reads: displacements, in host memory, of a lattice whose undeformed vertices
/// lie at whole steps, and how they are snapped.
struct VectorField {
  /// Number that raises steps to where floats are whole numbers, for vertices that move less than 2^22 steps (1024
  /// voxels).
  static constexpr float kLift = 3.0f * (1 << 22);
  static constexpr float kMostMoved = (1 << 22) - 1;

  const glm::vec3* displacement = nullptr;
  StepLattice lattice;  ///< without packed vertices
  FloatSnap snap;
  AffineMap output_from_lattice;
  glm::dmat3 output_from_mm{1};

  VectorField() = default;
  /// @param steps  with cells, of the whole lattice
  VectorField(const glm::vec3* displacements, const LatticeFrame& frame, const StepLattice& steps)
      : displacement(displacements),
        lattice(steps),
        snap(frame, steps, glm::vec3(kLift)),
        output_from_lattice(frame.output_from_lattice),
        output_from_mm(frame.output_from_mm) {}

  /// Number of the last vertex.
  int last_vertex() const { return lattice.slice * (lattice.cells.z + 1) - 1; }
};

}  // namespace tetwarp::cpu
