// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Whether tetrahedra own voxels, one of each a lane; included once for each instruction set (Highway's -inl.h files).
#if defined(TETWARP_VECTOR_TRIALS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TETWARP_VECTOR_TRIALS_INL_H_
#undef TETWARP_VECTOR_TRIALS_INL_H_
#else
#define TETWARP_VECTOR_TRIALS_INL_H_
#endif

#include <hwy/highway.h>

#include "deform/core/gather.h"
#include "deform/cpu/vector_tetrahedra-inl.h"

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

struct Cross3 {
  Float x, y, z;

  HWY_INLINE Cross3(const Vec3& a, const Vec3& b)
      : x(hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y))),
        y(hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z))),
        z(hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))) {}
};

HWY_INLINE Float dot(const Vec3& a, const Cross3& n) {
  return hn::Add(hn::Add(hn::Mul(a.x, n.x), hn::Mul(a.y, n.y)), hn::Mul(a.z, n.z));
}

HWY_INLINE Float norm1(const Vec3& v) { return hn::Add(hn::Add(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z)); }

HWY_INLINE Float left_of_one(const Vec3& w) { return hn::Sub(hn::Sub(hn::Sub(set(1.0f), w.x), w.y), w.z); }

HWY_INLINE Float least_of(const Vec3& w) { return hn::Min(hn::Min(w.x, w.y), hn::Min(w.z, left_of_one(w))); }

/// Tetrahedra as they are when deformed, seen from their vertices D. Steps.
struct DeformedTetrahedra {
  Vec3 moved;                            ///< how far D moved
  Vec3 further_a, further_b, further_c;  ///< how much further A, B, C moved
  Vec3 a, b, c;                          ///< from D to A, B, C
  FloatMask certain;                     ///< where all of it is known

  /// @param to  of `t`
  template <Snapping kSnapping>
  static HWY_INLINE DeformedTetrahedra of(const VectorField& field, const Tetrahedra& t, const Vec3& to) {
    const StepLattice& lattice = field.lattice;
    const Float zero = hn::Zero(Floats());
    const auto along = [&](Float v) { return hn::IfThenZeroElse(t.centre, v); };
    const auto across = [&](Float v) { return hn::IfThenElseZero(t.centre, v); };
    const auto at = [&](Float x, Float y, Float z) {  // for Snapping::in_double only
      return Vec3{hn::Add(t.d.x, x), hn::Add(t.d.y, y), hn::Add(t.d.z, z)};
    };
    FloatMask certain = hn::Eq(zero, zero);
    const Vec3 moved = moved_vertices<kSnapping>(field, t.at_d, t.d, certain);
    const Vec3 further_a =
        moved_vertices<kSnapping>(field, t.at_a, at(along(to.x), across(to.y), across(to.z)), certain) - moved;
    const Vec3 further_b =
        moved_vertices<kSnapping>(field, t.at_b, at(across(to.x), along(to.y), across(to.z)), certain) - moved;
    const Vec3 further_c =
        moved_vertices<kSnapping>(field, t.at_c, at(across(to.x), across(to.y), along(to.z)), certain) - moved;
    const Vec3 edge{hn::Mul(to.x, set(lattice.cell.x)), hn::Mul(to.y, set(lattice.cell.y)),
                    hn::Mul(to.z, set(lattice.cell.z))};
    const Vec3 edge_along{along(edge.x), along(edge.y), along(edge.z)},
        edge_across{across(edge.x), across(edge.y), across(edge.z)};
    return {
        moved,
        further_a,
        further_b,
        further_c,
        {hn::Add(edge_along.x, further_a.x), hn::Add(edge_across.y, further_a.y), hn::Add(edge_across.z, further_a.z)},
        {hn::Add(edge_across.x, further_b.x), hn::Add(edge_along.y, further_b.y), hn::Add(edge_across.z, further_b.z)},
        {hn::Add(edge_across.x, further_c.x), hn::Add(edge_across.y, further_c.y), hn::Add(edge_along.z, further_c.z)},
        certain};
  }
};

/// `Trial`, one a lane.
struct Trials {
  FloatMask owns;
  Vec3 moved;  ///< where it owns: deformed minus undeformed place, steps
  Tetrahedra t;
  Vec3 to, weights;
  Cross3 bc, ca, ab;
  Float factor;  ///< from a component of these to how much a weight changes from voxel to voxel
  DeformedTetrahedra deformed;
  Vec3 from_d;  ///< from vertices D to voxels, steps

  HWY_INLINE Vec3 place_of(const Vec3& w) const {
    const Float sum = hn::Add(hn::Add(w.x, w.y), w.z);
    const auto on_axis = [&](Float weight, Float direction, Float d) {
      const Float shift = hn::IfThenElse(t.centre, hn::Sub(sum, weight), weight);  // A of a centre lies along j and k
      return hn::MulAdd(direction, shift, d);
    };
    return {on_axis(w.x, to.x, t.d.x), on_axis(w.y, to.y, t.d.y), on_axis(w.z, to.z, t.d.z)};
  }
  HWY_INLINE Vec3 place() const { return place_of(weights); }
  HWY_INLINE Vec3 next_along_k() const { return next(bc.z, ca.z, ab.z); }
  HWY_INLINE Vec3 next_along_j() const { return next(bc.y, ca.y, ab.y); }

 private:
  HWY_INLINE Vec3 next(Float a, Float b, Float c) const {
    return place_of(
        {hn::MulAdd(a, factor, weights.x), hn::MulAdd(b, factor, weights.y), hn::MulAdd(c, factor, weights.z)});
  }
};

/// The numerators of the weights at nudged voxels and what they leave of the determinant, in double: how far the least
/// of them is above its rounding error. Of coordinates below 2^24 steps only the last sums are rounded.
/// @param error  bound of the rounding errors in float
HWY_INLINE hn::Vec<HalfFloats> clearance(const DoubleVec3& a, const DoubleVec3& b, const DoubleVec3& c,
                                         const DoubleVec3& r, const DoubleVec3& nudge, Double turn, Double error) {
  const Doubles dd;
  const DoubleVec3 q{hn::Add(r.x, nudge.x), hn::Add(r.y, nudge.y), hn::Add(r.z, nudge.z)};  // float may round it
  const auto cross = [](const DoubleVec3& u, const DoubleVec3& v) {
    return DoubleVec3{hn::Sub(hn::Mul(u.y, v.z), hn::Mul(u.z, v.y)), hn::Sub(hn::Mul(u.z, v.x), hn::Mul(u.x, v.z)),
                      hn::Sub(hn::Mul(u.x, v.y), hn::Mul(u.y, v.x))};
  };
  const auto times = [](const DoubleVec3& u, const DoubleVec3& v) {
    return hn::Add(hn::Add(hn::Mul(u.x, v.x), hn::Mul(u.y, v.y)), hn::Mul(u.z, v.z));
  };
  const DoubleVec3 bc = cross(b, c);
  const Double det = times(a, bc), qa = times(q, bc), qb = times(q, cross(c, a)), qc = times(q, cross(a, b));
  const Double qd = hn::Sub(hn::Sub(hn::Sub(det, qa), qb), qc);
  const auto turned = [&](Double v) { return hn::Mul(v, turn); };
  const Double least = hn::Min(hn::Min(turned(qa), turned(qb)), hn::Min(turned(qc), turned(qd)));
  constexpr double kFiner = 1.0 / (1 << 29);  // units of rounding
  return hn::DemoteTo(HalfFloats(), hn::Sub(least, hn::Mul(error, hn::Set(dd, kFiner))));
}

/// Where that is above zero. @param turn  1 or -1: sign of an upright determinant
HWY_INLINE FloatMask inside_in_double(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& r, const Vec3& nudge,
                                      Float turn, Float error) {
  const Float clear =
      in_halves([](const DoubleVec3& da, const DoubleVec3& db, const DoubleVec3& dc, const DoubleVec3& dr,
                   const DoubleVec3& dn, const DoubleVec3& dt) { return clearance(da, db, dc, dr, dn, dt.x, dt.y); },
                a, b, c, r, nudge, Vec3{turn, error, error});
  return hn::Gt(clear, hn::Zero(Floats()));
}

/// `try_tetrahedron`, one a lane. With full effort what float leaves open is decided in double.
/// @param steps, nudge  as of `GatherPoint`
template <Snapping kSnapping, Effort kEffort>
HWY_INLINE Trials try_tetrahedra(const VectorField& field, const Vec3& place, const Vec3& steps, const Vec3& nudge) {
  const StepLattice& lattice = field.lattice;
  const Tetrahedra t(lattice, place);
  const Vec3 to = t.to();
  const DeformedTetrahedra deformed = DeformedTetrahedra::of<kSnapping>(field, t, to);
  const auto& [moved, further_a, further_b, further_c, a, b, c, certain] = deformed;
  const Vec3 r{hn::Sub(hn::NegMulAdd(t.d.x, set(lattice.cell.x), steps.x), moved.x),
               hn::Sub(hn::NegMulAdd(t.d.y, set(lattice.cell.y), steps.y), moved.y),
               hn::Sub(hn::NegMulAdd(t.d.z, set(lattice.cell.z), steps.z), moved.z)};

  const Cross3 bc(b, c), ca(c, a), ab(a, b);
  const Float det = dot(a, bc), na = dot(r, bc), nb = dot(r, ca), nc = dot(r, ab);
  const Float reciprocal = hn::Div(set(1.0f), det);  // flat: not finite, and owns nothing
  const auto nudged = [&](Float value, const Cross3& n) {
    return hn::Mul(hn::MulAdd(nudge.x, n.x, hn::MulAdd(nudge.y, n.y, hn::MulAdd(nudge.z, n.z, value))), reciprocal);
  };
  const Vec3 weights{nudged(na, bc), nudged(nb, ca), nudged(nc, ab)};
  const Vec3 w{hn::Mul(na, reciprocal), hn::Mul(nb, reciprocal), hn::Mul(nc, reciprocal)};
  const Float s = hn::Add(hn::Add(norm1(a), norm1(b)), norm1(c)), squared = hn::Mul(s, s);
  const Float error = hn::Mul(
      squared, hn::MulAdd(s, set(detail::kUnit / 3),
                          hn::MulAdd(norm1(r), set(5 * detail::kUnit), set(5 * detail::kNudgeNorm * detail::kUnit))));
  const FloatMask turned = hn::Xor(hn::Xor(t.down_x, t.down_y), t.down_z);
  const Float upright = hn::IfThenElse(turned, hn::Neg(det), det);  // A, B, C turn like that when undeformed
  FloatMask usable;
  if constexpr (kEffort == Effort::full) {
    const Float slack = set(-static_cast<float>(kWeightSlack));
    usable = hn::And(hn::Gt(upright, hn::Mul(set(detail::kThinSum), hn::Mul(squared, s))), hn::Ge(least_of(w), slack));
  } else {
    usable = hn::Gt(upright, hn::Mul(squared, hn::MulAdd(set(detail::kThinSum), s, set(detail::kSlackSum))));
  }
  FloatMask inside;
  if constexpr (kEffort == Effort::full) {
    inside = inside_in_double(a, b, c, r, nudge, hn::IfThenElse(turned, set(-1.0f), set(1.0f)), error);
  } else {
    inside = hn::Gt(least_of(weights), hn::MulAdd(error, hn::Abs(reciprocal), set(8 * detail::kUnit)));
  }
  const auto blended = [&](Float of_d, Float of_a, Float of_b, Float of_c) {
    return hn::Add(hn::Add(hn::Add(of_d, hn::Mul(w.x, of_a)), hn::Mul(w.y, of_b)), hn::Mul(w.z, of_c));
  };
  return {
      hn::And(hn::And(inside, usable), certain),
      {blended(moved.x, further_a.x, further_b.x, further_c.x), blended(moved.y, further_a.y, further_b.y, further_c.y),
       blended(moved.z, further_a.z, further_b.z, further_c.z)},
      t,
      to,
      weights,
      bc,
      ca,
      ab,
      hn::Mul(reciprocal, set(float{kStepsPerVoxel})),
      deformed,
      r};
}

/// u in voxels: `to_offset`.
HWY_INLINE Vec3 to_offset(const Vec3& moved) {
  const Float zero = hn::Zero(Floats()), scale = set(kVoxelsPerStep);
  return {hn::Sub(zero, hn::Mul(moved.x, scale)), hn::Sub(zero, hn::Mul(moved.y, scale)),
          hn::Sub(zero, hn::Mul(moved.z, scale))};
}

/// Voxels of one axis, as `GatherPoint` has them.
struct PointAxis {
  Float steps, nudge;

  HWY_INLINE PointAxis(Int voxel, const VectorField& field, const NudgeTurns& turns, int axis, int size) {
    const Floats df;
    steps = hn::Sub(hn::Mul(hn::ConvertTo(df, voxel), set(float{kStepsPerVoxel})), set(field.lattice.first[axis]));
    const float by = static_cast<float>(size) / kNudgeSteps;
    const FloatMask up = hn::RebindMask(df, hn::Lt(voxel, set(turns.first_down[axis])));
    nudge = hn::IfThenElse(up, set(by), set(-by));
  }
};

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#endif  // the toggle
