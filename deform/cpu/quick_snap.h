// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>

#include "deform/core/lattice_vertex.h"
#include "deform/core/step_lattice.h"

namespace tetwarp::cpu {

/// Snaps vertices of a lattice that lies along the axes of the grid, with undeformed vertices at whole steps, in few
/// operations: to snap is to round the undeformed and the deformed place of a vertex to whole steps of 2^-12 voxel of
/// the output. It gives the bits of `LatticeFrame::snap_vertex`: it leaves out sums and products with zero, which
/// change nothing, and computes in steps instead of voxels, which changes no rounding, for a step is a power of two.
class QuickSnap {
 public:
  QuickSnap() = default;
  /// @param frame  where the lattice lies in the output
  /// @param steps  the lattice at whole steps; if it has no cells, `is_usable` is false
  QuickSnap(const LatticeFrame& frame, const StepLattice& steps) {
    constexpr double kApart = 0.02;  // steps: more than rest places differ from whole multiples of cells, by all axes
    rests_at_steps_ = steps.cells.x != 0 && frame.first_slice == 0;
    usable_ = rests_at_steps_;
    const glm::dvec3 first = frame.output_from_lattice(glm::dvec3(0));
    for (int axis = 0; axis < 3; ++axis) {
      first_[axis] = first[axis] * kStepsPerVoxel;
      cell_[axis] = frame.output_from_lattice.linear[axis][axis] * kStepsPerVoxel;
      scale_[axis] = frame.output_from_mm[axis][axis] * kStepsPerVoxel;
      for (int other = 0; other < 3; ++other) {
        usable_ = usable_ && (other == axis || (frame.output_from_mm[axis][other] == 0 &&
                                                frame.output_from_lattice.linear[axis][other] == 0));
      }
      rests_at_steps_ = rests_at_steps_ && std::fabs(std::fabs(first_[axis] - std::rint(first_[axis])) - 0.5) > kApart;
    }
    usable_ = usable_ && rests_at_steps_;
    rest_ = glm::ivec3(steps.first);
    rest_cell_ = glm::ivec3(steps.cell);
  }

  /// Whether `snap` may be called: the lattice lies along the axes of the grid, and `rests_at_steps` holds.
  bool is_usable() const { return usable_; }
  /// Whether every undeformed vertex is snapped to where the StepLattice has it: no place is so near to the middle
  /// between two steps that rounding decides.
  bool rests_at_steps() const { return rests_at_steps_; }
  /// Snaps one vertex. @param at  its index in the lattice  @param displacement  LPS mm
  /// @return false for a vertex that is far away or not finite; then `LatticeFrame::snap_vertex` must decide
  bool snap(const glm::ivec3& at, const glm::vec3& displacement, Vertex& vertex) const {
    glm::dvec3 rounded(0);
    bool near = true;
    for (int axis = 0; axis < 3; ++axis) {
      const double shift = scale_[axis] * double{displacement[axis]},
                   place = (at[axis] * cell_[axis] + first_[axis]) + shift;
      rounded[axis] = (place + kToWhole) - kToWhole;
      near &= std::fabs(shift) < kFar;  // false for NaN
    }
    if (!near) return false;
    vertex.deformed = glm::i32vec3(rounded);
    vertex.u = rest_ + at * rest_cell_ - vertex.deformed;
    return true;
  }

 private:
  static constexpr double kToWhole =
      3.0 * (std::int64_t{1} << 51);       ///< adding it rounds to whole numbers, ties to even
  static constexpr double kFar = 1 << 28;  ///< steps

  bool usable_ = false, rests_at_steps_ = false;
  /// The first undeformed vertex and the distance to the next on each axis, in steps; steps in a mm.
  glm::dvec3 first_{0}, cell_{0}, scale_{0};
  /// `first_` and `cell_`, snapped.
  glm::ivec3 rest_{0}, rest_cell_{0};
};

}  // namespace tetwarp::cpu
