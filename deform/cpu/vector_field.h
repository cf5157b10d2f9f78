// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/float_snap.h"
#include "deform/core/lattice_vertex.h"
#include "deform/core/step_lattice.h"

namespace tetwarp::cpu {

/// A field in the form that code with vector instructions reads: displacements, in host memory, of a lattice whose
/// undeformed vertices lie at whole steps (2^-12 voxel of the output), and how they are snapped. It keeps no copy of
/// the displacements.
struct VectorField {
  /// A float from which on floats are whole numbers: adding it to a motion in steps rounds that to whole steps, for
  /// vertices that move less than 2^22 steps (1024 voxels).
  static constexpr float kLift = 3.0f * (1 << 22);
  /// The largest motion of a vertex along an axis, in steps, for which this form can be used.
  static constexpr float kMostMoved = (1 << 22) - 1;

  const glm::vec3* displacement = nullptr;  ///< of each vertex, LPS mm, i fastest
  StepLattice lattice;                      ///< the undeformed vertices; `StepLattice::packed` is null
  FloatSnap snap;                           ///< turns displacements into steps, in float
  AffineMap output_from_lattice;            ///< from vertex index to output index
  glm::dmat3 output_from_mm{1};             ///< from a displacement to voxels of the output

  VectorField() = default;
  /// @param displacements  one for each vertex of the whole lattice; must outlive this object
  /// @param frame          where the lattice lies in the output
  /// @param steps          the lattice at whole steps; it must have cells, and be the whole lattice
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
