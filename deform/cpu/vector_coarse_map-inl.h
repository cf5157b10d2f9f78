// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// U of voxels of coarse fields, one a lane; included once for each instruction set (Highway's -inl.h files).
#if defined(TETWARP_VECTOR_COARSE_MAP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TETWARP_VECTOR_COARSE_MAP_INL_H_
#undef TETWARP_VECTOR_COARSE_MAP_INL_H_
#else
#define TETWARP_VECTOR_COARSE_MAP_INL_H_
#endif

#include <hwy/highway.h>

#include "deform/core/coarse_map.h"
#include "deform/cpu/vector_trials-inl.h"

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

/// U of a vector of voxels, 2^-23 voxel, modulo 2^32.
struct FixedU {
  Int x, y, z;
  IntMask usable;  ///< where the map of the tetrahedron is
};

using HalfInts = hn::Rebind<std::int32_t, HalfFloats>;

/// The same of half a vector; usable: not 0.
struct HalfU {
  hn::Vec<HalfInts> x, y, z, usable;
};

/// `CoarseMap` and U of one voxel, in the order of its operations. Whole numbers below 2^53 are exact in double however
/// they are added up, and so are cross products of edges below 2^24 steps. How far vertices moved takes the place of u:
/// all signs turn round, and rounding is the same on both sides of zero.
/// @param a, b, c  edges from D  @param r  from D to the voxel  @param moved, further_a, ...  of `DeformedTetrahedra`;
/// all in steps
HWY_INLINE HalfU coarse_u(const DoubleVec3& a, const DoubleVec3& b, const DoubleVec3& c, const DoubleVec3& r,
                          const DoubleVec3& moved, const DoubleVec3& further_a, const DoubleVec3& further_b,
                          const DoubleVec3& further_c) {
  const Doubles dd;
  const auto constant = [&](double value) { return hn::Set(dd, value); };
  const auto cross = [](const DoubleVec3& p, const DoubleVec3& q) {
    return DoubleVec3{hn::Sub(hn::Mul(p.y, q.z), hn::Mul(p.z, q.y)), hn::Sub(hn::Mul(p.z, q.x), hn::Mul(p.x, q.z)),
                      hn::Sub(hn::Mul(p.x, q.y), hn::Mul(p.y, q.x))};
  };
  const auto norm = [](const DoubleVec3& v) { return hn::Add(hn::Add(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z)); };
  const auto sum = [](Double x, Double y, Double z) { return hn::Add(hn::Add(x, y), z); };
  const DoubleVec3 bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
  const Double det = sum(hn::Mul(a.x, bc.x), hn::Mul(a.y, bc.y), hn::Mul(a.z, bc.z));
  const Double inverse = hn::Div(constant(1.0), det);
  auto usable = hn::Ge(hn::Abs(det), hn::Mul(constant(0x1p-16), hn::Mul(hn::Mul(norm(a), norm(b)), norm(c))));
  // From the voxel to the origin of the map, in voxels; from D to the origin, in steps.
  const auto to_origin = [&](Double x, Double y, Double z, Double from_d) {
    return hn::Floor(hn::Mul(hn::Sub(sum(x, y, z), hn::Mul(constant(4.0), from_d)), constant(0x1p-14)));
  };
  const DoubleVec3 o{to_origin(a.x, b.x, c.x, r.x), to_origin(a.y, b.y, c.y, r.y), to_origin(a.z, b.z, c.z, r.z)};
  const auto from_d = [&](Double voxels, Double steps) {
    return hn::Add(hn::Mul(constant(double{kStepsPerVoxel}), voxels), steps);
  };
  const DoubleVec3 e{from_d(o.x, r.x), from_d(o.y, r.y), from_d(o.z, r.z)};
  const auto axis = [&](Double of_d, Double of_a, Double of_b, Double of_c) {
    const auto slope = [&](Double along_bc, Double along_ca, Double along_ab) {
      const Double steepness =
          hn::Mul(sum(hn::Mul(of_a, along_bc), hn::Mul(of_b, along_ca), hn::Mul(of_c, along_ab)), inverse);
      usable = hn::And(usable, hn::Lt(hn::Abs(steepness), constant(128)));
      return steepness;
    };
    const Double x = slope(bc.x, ca.x, ab.x), y = slope(bc.y, ca.y, ab.y), z = slope(bc.z, ca.z, ab.z);
    const auto rounded = [&](Double value, double scale) { return hn::Round(hn::Mul(value, constant(scale))); };
    const Double at_origin = rounded(hn::Add(of_d, sum(hn::Mul(x, e.x), hn::Mul(y, e.y), hn::Mul(z, e.z))), 0x1p11);
    return hn::DemoteTo(HalfInts(), hn::Sub(sum(hn::Mul(rounded(x, 0x1p23), o.x), hn::Mul(rounded(y, 0x1p23), o.y),
                                                hn::Mul(rounded(z, 0x1p23), o.z)),
                                            at_origin));
  };
  HalfU u;
  u.x = axis(moved.x, further_a.x, further_b.x, further_c.x);
  u.y = axis(moved.y, further_a.y, further_b.y, further_c.y);
  u.z = axis(moved.z, further_a.z, further_b.z, further_c.z);
  u.usable = hn::DemoteTo(HalfInts(), hn::IfThenElseZero(usable, constant(1)));
  return u;
}

/// U of the voxels that trials were made of, where these own them, if no vertex moves as far as 255 voxels.
HWY_INLINE FixedU coarse_u(const Trials& trials) {
  const DeformedTetrahedra& t = trials.deformed;
  const auto half = [&](auto&& part) {
    const auto of = [&](const Vec3& v) { return promoted(part(v.x), part(v.y), part(v.z)); };
    return coarse_u(of(t.a), of(t.b), of(t.c), of(trials.from_d), of(t.moved), of(t.further_a), of(t.further_b),
                    of(t.further_c));
  };
  const Ints di;
#if HWY_TARGET == HWY_SCALAR
  const HalfU all = half([](Float v) { return v; });
  return {all.x, all.y, all.z, hn::Ne(all.usable, hn::Zero(di))};
#else
  const HalfFloats dh;
  const HalfU low = half([](Float v) { return hn::LowerHalf(v); }),
              high = half([&](Float v) { return hn::UpperHalf(dh, v); });
  return {hn::Combine(di, high.x, low.x), hn::Combine(di, high.y, low.y), hn::Combine(di, high.z, low.z),
          hn::Ne(hn::Combine(di, high.usable, low.usable), hn::Zero(di))};
#endif
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#endif  // the toggle
