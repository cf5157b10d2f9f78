// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Snapping of vertices with vectors; included once for each instruction set (Highway's -inl.h files).
#if defined(TETWARP_VECTOR_SNAP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TETWARP_VECTOR_SNAP_INL_H_
#undef TETWARP_VECTOR_SNAP_INL_H_
#else
#define TETWARP_VECTOR_SNAP_INL_H_
#endif

#include <hwy/highway.h>

#include "deform/cpu/vector_field.h"

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
#if HWY_TARGET == HWY_SCALAR
using HalfFloats = Floats;  // one lane has no halves
#else
using HalfFloats = hn::Half<Floats>;
#endif
using Doubles = hn::Rebind<double, HalfFloats>;
using Float = hn::Vec<Floats>;
using Int = hn::Vec<Ints>;
using Double = hn::Vec<Doubles>;
using FloatMask = hn::Mask<Floats>;

/// Defined where `MulAdd` rounds once.
#if HWY_ARCH_X86
constexpr bool kFused = HWY_TARGET <= HWY_AVX2;
#else
constexpr bool kFused = HWY_ARCH_ARM_A64 != 0;
#endif

struct Vec3 {
  Float x, y, z;
};

/// The numbers first, first + 1, ... in rising lanes. (Highway makes Iota of a number that is not constant lane by
/// lane.)
HWY_INLINE Int numbers_from(int first) { return hn::Add(hn::Iota(Ints(), 0), hn::Set(Ints(), first)); }
HWY_INLINE Float set(float value) { return hn::Set(Floats(), value); }
HWY_INLINE Vec3 set(const glm::vec3& v) { return {set(v.x), set(v.y), set(v.z)}; }
HWY_INLINE Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

/// How displacements are snapped. Float serves only where `MulAdd` is fused and `FloatSnap` is usable.
enum class Snapping {
  float_with_ties,  ///< also ties are exact: `FloatSnap::is_exact`
  in_float,         ///< lanes where float is not certain are marked
  in_double         ///< with the operations of `LatticeFrame::snap_vertex`; always certain
};

template <Snapping kSnapping>
HWY_INLINE Float snap_axis(const FloatSnap& snap, int axis, Float displacement, FloatMask& certain) {
  const Float high = set(snap.high()[axis]), lift = set(VectorField::kLift);
  const Float moved = hn::Sub(hn::MulAdd(displacement, high, lift), lift);
  if constexpr (kSnapping == Snapping::in_float) {
    const Float left = hn::MulAdd(displacement, set(snap.low()[axis]), hn::MulSub(displacement, high, moved));
    certain = hn::And(certain, hn::Lt(hn::Abs(left), set(snap.clear())));
  }
  return moved;
}

/// Half of the lanes of three vectors, in double.
struct DoubleVec3 {
  Double x, y, z;
};

HWY_INLINE DoubleVec3 promoted(hn::Vec<HalfFloats> x, hn::Vec<HalfFloats> y, hn::Vec<HalfFloats> z) {
  const Doubles dd;
  return {hn::PromoteTo(dd, x), hn::PromoteTo(dd, y), hn::PromoteTo(dd, z)};
}

/// Calls `f` with the lower and with the upper halves of vectors, and joins the floats that it returns.
template <class F, class... Vectors>
HWY_INLINE Float in_halves(F&& f, const Vectors&... v) {
#if HWY_TARGET == HWY_SCALAR
  return f(promoted(v.x, v.y, v.z)...);
#else
  const HalfFloats dh;
  const auto low = f(promoted(hn::LowerHalf(v.x), hn::LowerHalf(v.y), hn::LowerHalf(v.z))...);
  const auto high = f(promoted(hn::UpperHalf(dh, v.x), hn::UpperHalf(dh, v.y), hn::UpperHalf(dh, v.z))...);
  return hn::Combine(Floats(), high, low);
#endif
}

/// How many steps vertices move along one axis, by the operations of `AffineMap` and `LatticeFrame::snap_vertex`.
HWY_INLINE hn::Vec<HalfFloats> moved_in_double(const VectorField& field, int axis, const DoubleVec3& displacement,
                                               const DoubleVec3& at) {
  const Doubles dd;
  const auto times = [&](const glm::dmat3& m, const DoubleVec3& v) {
    return hn::Add(hn::Add(hn::Mul(hn::Set(dd, m[0][axis]), v.x), hn::Mul(hn::Set(dd, m[1][axis]), v.y)),
                   hn::Mul(hn::Set(dd, m[2][axis]), v.z));
  };
  const Double rest =
      hn::Add(times(field.output_from_lattice.linear, at), hn::Set(dd, field.output_from_lattice.offset[axis]));
  const Double place = hn::Add(rest, times(field.output_from_mm, displacement));
  const Double deformed = hn::Round(hn::Mul(place, hn::Set(dd, double{kStepsPerVoxel})));
  const Double along = axis == 0 ? at.x : (axis == 1 ? at.y : at.z);
  const Double from = hn::Add(hn::Mul(along, hn::Set(dd, double{field.lattice.cell[axis]})),
                              hn::Set(dd, double{field.lattice.first[axis]}));
  return hn::DemoteTo(HalfFloats(), hn::Sub(deformed, from));
}

/// How many steps vertices move. @param at  index of the vertices  @param certain  set to false in lanes where float
/// cannot tell
template <Snapping kSnapping>
HWY_INLINE Vec3 moved_steps(const VectorField& field, const Vec3& displacement, const Vec3& at, FloatMask& certain) {
  if constexpr (kSnapping == Snapping::in_double) {
    const auto axis = [&](int n) {
      return in_halves([&](const DoubleVec3& d, const DoubleVec3& v) { return moved_in_double(field, n, d, v); },
                       displacement, at);
    };
    return {axis(0), axis(1), axis(2)};
  } else {
    return {snap_axis<kSnapping>(field.snap, 0, displacement.x, certain),
            snap_axis<kSnapping>(field.snap, 1, displacement.y, certain),
            snap_axis<kSnapping>(field.snap, 2, displacement.z, certain)};
  }
}

/// Calls `f` with the fastest Snapping that a field allows, as a constant.
template <class F>
HWY_INLINE auto with_snapping(const VectorField& field, F&& f) {
  if constexpr (kFused) {
    if (field.snap.is_exact()) return f(std::integral_constant<Snapping, Snapping::float_with_ties>());
    if (field.snap.is_usable()) return f(std::integral_constant<Snapping, Snapping::in_float>());
  }
  return f(std::integral_constant<Snapping, Snapping::in_double>());
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#endif  // the toggle
