#pragma once

#include "cuda/findings.cuh"
#include "cuda/step_pass.h"

/// From displacements to whole steps, mostly in float. For the files that pass over a field.
namespace tetwarp::cuda_detail {

namespace {

constexpr float kMost = 1 << 23;  ///< steps that a vertex may move: all is exact in float

/// Snaps displacements in float where that certainly gives what `LatticeFrame::snap_vertex` gives.
///
/// With an axis of the lattice along each axis of the grid, a displacement in steps is d m, m = high + low to 48 bits.
/// Adding what raises it to where floats are whole numbers (StepPacking), fused, rounds d high to whole steps; the
/// rest, known to 2^-20 step, decides wherever it is not that close to a half. Where m is a power of two and vertices
/// rest at even steps, all of that is exact, and ties go to even here as there. Other ties, and far and unusable
/// vertices, need double arithmetic.
class FloatSnap {
 public:
  explicit FloatSnap(const LatticeFrame& frame, const StepLattice& lattice) : lift_(lattice.packing.lift()) {
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

  /// Whether ties go to even steps here as there.
  bool is_exact() const { return exact_; }

  /// The displacement in whole steps, raised; right where it can be packed and it `is_certain`.
  __device__ glm::vec3 raised(const glm::vec3& displacement) const {
    return {fmaf(displacement.x, high_.x, lift_.x), fmaf(displacement.y, high_.y, lift_.y),
            fmaf(displacement.z, high_.z, lift_.z)};
  }
  /// Where ties are not exact: whether there is none. No `&&`: branches would cost more than they save.
  __device__ bool is_certain(const glm::vec3& displacement, const glm::vec3& raised) const {
    bool certain = true;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      const float left = fmaf(displacement[axis], high_[axis], lift_[axis] - raised[axis]);
      certain &= fabsf(fmaf(displacement[axis], low_[axis], left)) < clear_;
    }
    return certain;
  }

 private:
  glm::vec3 high_{0}, low_{0}, lift_;
  float clear_ = -1;  ///< what is left decides where it is smaller; negative: never
  bool exact_ = false;
};

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
