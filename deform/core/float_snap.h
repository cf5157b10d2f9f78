// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/lattice_vertex.h"
#include "deform/core/step_lattice.h"

namespace tetwarp {

/// Snaps displacements in float where the result is certainly that of `LatticeFrame::snap_vertex`.
///
/// It needs an axis of the lattice along each axis of the grid. Then a displacement in steps of 2^-12 voxel is d m,
/// where m = high + low to 48 bits. One fused multiply-add of d high and a number that raises it to where floats are
/// whole numbers (StepPacking) rounds d high to whole steps. The remainder, known to 2^-20 step, proves the rounding
/// unless it is close to a half. Where m is a power of two and undeformed vertices lie at even steps all of this is
/// exact, and ties go to even as in `snap_vertex`. All other ties, and vertices that are far away or not finite, need
/// double arithmetic.
class FloatSnap {
 public:
  FloatSnap() = default;
  /// @param lift  even whole numbers above 2^23
  FloatSnap(const LatticeFrame& frame, const StepLattice& lattice, const glm::vec3& lift) : lift_(lift) {
    const glm::dvec3 first = frame.output_from_lattice(glm::dvec3(0, 0, static_cast<double>(frame.first_slice)));
    double beside = 0;  // how far a vertex may rest from its whole step
    exact_ = true;
    for (int axis = 0; axis < 3; ++axis) {
      for (int other = 0; other < 3; ++other) {
        if (other != axis && frame.output_from_mm[axis][other] != 0) beside = 1;
        const double meant = axis == other ? double{lattice.cell[axis]} : 0.0;
        beside += std::fabs(frame.output_from_lattice.linear[axis][other] * kStepsPerVoxel - meant) *
                  static_cast<double>(frame.cells[axis]);
      }
      beside += std::fabs(first[axis] * kStepsPerVoxel - double{lattice.first[axis]});
      const double scale = frame.output_from_mm[axis][axis] * kStepsPerVoxel;
      high_[axis] = static_cast<float>(scale);
      low_[axis] = static_cast<float>(scale - double{high_[axis]});
      int exponent = 0;
      exact_ = exact_ && std::fabs(std::frexp(scale, &exponent)) == 0.5 && std::fmod(lattice.first[axis], 2.0f) == 0 &&
               std::fmod(lattice.cell[axis], 2.0f) == 0;
    }
    exact_ = exact_ && beside == 0;
    clear_ = static_cast<float>(0.5 - 1.0 / (1 << 16) - beside);
  }

  /// Whether the rounding of any vertex can be proved.
  bool is_usable() const { return clear_ > 0; }
  /// Whether ties go to even steps as in `LatticeFrame::snap_vertex`.
  bool is_exact() const { return exact_; }
  /// The rounding is proved where the remainder is smaller than this, in steps.
  float clear() const { return clear_; }
  const glm::vec3& high() const { return high_; }
  const glm::vec3& low() const { return low_; }
  const glm::vec3& lift() const { return lift_; }

  /// The displacement (LPS mm) in whole steps, raised; valid where it can be packed and `is_certain`.
  TETWARP_HD glm::vec3 raised(const glm::vec3& displacement) const {
    return {fmaf(displacement.x, high_.x, lift_.x), fmaf(displacement.y, high_.y, lift_.y),
            fmaf(displacement.z, high_.z, lift_.z)};
  }
  /// For a field where `is_exact` is false: whether no component is near a tie. It has no `&&`, because branches would
  /// cost more than they save.
  TETWARP_HD bool is_certain(const glm::vec3& displacement, const glm::vec3& raised) const {
    bool certain = true;
#ifdef TETWARP_ON_DEVICE
#pragma unroll
#endif
    for (int axis = 0; axis < 3; ++axis) {
      const float left = fmaf(displacement[axis], high_[axis], lift_[axis] - raised[axis]);
      certain &= std::fabs(fmaf(displacement[axis], low_[axis], left)) < clear_;
    }
    return certain;
  }

 private:
  glm::vec3 high_{0}, low_{0}, lift_{0};
  float clear_ = -1;  ///< negative: no rounding can be proved
  bool exact_ = false;
};

}  // namespace tetwarp
