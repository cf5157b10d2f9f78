// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/intervals/tetrahedron_batch.h"

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/intervals/tetrahedron_batch.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::ScalableTag<double>;
using Ints = hn::Rebind<std::int32_t, Doubles>;
using Floats = hn::Rebind<float, Doubles>;
using Double = hn::Vec<Doubles>;
using Float = hn::Vec<Floats>;

constexpr int kMost = TetrahedronBatch::kMost;

HWY_INLINE Double set(double value) { return hn::Set(Doubles(), value); }
HWY_INLINE Float in_float(Double value) { return hn::DemoteTo(Floats(), value); }

struct Vec3 {
  Double x, y, z;
};

HWY_INLINE Vec3 operator-(const Vec3& p, const Vec3& q) {
  return {hn::Sub(p.x, q.x), hn::Sub(p.y, q.y), hn::Sub(p.z, q.z)};
}
/// Each product and difference rounded once, as in the cross products of deform/core.
HWY_INLINE Vec3 cross(const Vec3& p, const Vec3& q) {
  return {hn::Sub(hn::Mul(p.y, q.z), hn::Mul(p.z, q.y)), hn::Sub(hn::Mul(p.z, q.x), hn::Mul(p.x, q.z)),
          hn::Sub(hn::Mul(p.x, q.y), hn::Mul(p.y, q.x))};
}
/// From left to right.
HWY_INLINE Double sum(Double x, Double y, Double z) { return hn::Add(hn::Add(x, y), z); }
HWY_INLINE Double dot(const Vec3& p, const Vec3& q) {
  return sum(hn::Mul(p.x, q.x), hn::Mul(p.y, q.y), hn::Mul(p.z, q.z));
}
HWY_INLINE Double norm1(const Vec3& v) { return sum(hn::Abs(v.x), hn::Abs(v.y), hn::Abs(v.z)); }
HWY_INLINE Double largest(const Vec3& v) { return hn::Max(hn::Max(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z)); }

/// Corner A, B, C or D (0 to 3) of a vector of tetrahedra, the n-th and on.
HWY_INLINE Vec3 corner(const TetrahedronBatch::Corners& of, int which, int n) {
  const auto along = [&](int axis) { return hn::PromoteTo(Doubles(), hn::Load(Ints(), of.at[which][axis] + n)); };
  return {along(0), along(1), along(2)};
}

/// `RowFace` of a tetrahedron a lane, and the sign of its normal along rows.
struct Face {
  Float at, along_y, along_z, error, normal;
};

/// `detail::row_face`.
HWY_INLINE Face row_face(const Vec3& normal, Double constant, Float wrong, const glm::vec3& size) {
  constexpr float kFar = 0x1p40f, kVoxel = kStepsPerVoxel, kRounding = 8 * detail::kUnit;
  const Floats df;
  const auto constant_of = [&](float value) { return hn::Set(df, value); };
  const Float voxel = constant_of(kVoxel), x = in_float(normal.x), c = in_float(constant),
              along_y = hn::Mul(in_float(normal.y), voxel), along_z = hn::Mul(in_float(normal.z), voxel);
  const auto reach = [&](Float of, Float y, Float z) {
    return hn::Add(hn::Add(hn::Abs(of), hn::Mul(hn::Abs(y), constant_of(size.y))),
                   hn::Mul(hn::Abs(z), constant_of(size.z)));
  };
  const auto flat = hn::Eq(x, hn::Zero(df));
  const Float over = hn::IfThenElse(flat, hn::Add(reach(c, along_y, along_z), voxel), hn::Mul(x, voxel)),
              factor = hn::Div(hn::IfThenElse(flat, constant_of(-kFar), constant_of(1)), over);
  Face face;
  face.at = hn::Mul(c, factor);
  face.along_y = hn::Neg(hn::Mul(along_y, factor));
  face.along_z = hn::Neg(hn::Mul(along_z, factor));
  face.error = hn::Add(hn::Mul(constant_of(kRounding), reach(face.at, face.along_y, face.along_z)),
                       hn::Mul(hn::Add(wrong, wrong), hn::Abs(factor)));
  face.normal = x;
  return face;
}

/// The numbers of a face, one tetrahedron after the other.
struct FaceNumbers {
  alignas(64) float at[kMost], along_y[kMost], along_z[kMost], error[kMost], normal[kMost];
};

/// The box of a vector of tetrahedra, in voxels from the first of a tile, cut to the tile, and whether it is so short
/// that 64 bits hold determinants: `fits_int64`.
struct Boxes {
  alignas(64) std::int32_t begin[3][kMost], end[3][kMost];
  alignas(64) float fits_int64[kMost];

  HWY_INLINE void find(const TetrahedronBatch& batch, int n, const glm::ivec3& first, const glm::i32vec3& signs,
                       const glm::ivec3& size) {
    const Ints di;
    Double longest = set(0);
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = [&](int corner) { return hn::Load(di, batch.deformed().at[corner][axis] + n); };
      const auto low = hn::Min(hn::Min(at(0), at(1)), hn::Min(at(2), at(3))),
                 high = hn::Max(hn::Max(at(0), at(1)), hn::Max(at(2), at(3)));
      longest = hn::Max(longest, hn::Sub(hn::PromoteTo(Doubles(), high), hn::PromoteTo(Doubles(), low)));
      // Counted from the voxel before the first; a box is closed on the side from which voxels are nudged away.
      const auto behind = [&](auto steps) {
        const auto up = hn::Set(di, signs[axis] > 0 ? 1 : 0);
        return hn::Sub(hn::ShiftRight<12>(hn::Sub(steps, up)), hn::Set(di, first[axis] - 1));
      };
      hn::Store(hn::Max(behind(low), hn::Zero(di)), di, begin[axis] + n);
      hn::Store(hn::Min(behind(high), hn::Set(di, size[axis])), di, end[axis] + n);
    }
    const auto fits = hn::Le(hn::Add(longest, set(kStepsPerVoxel)), set(1 << 18));
    hn::Store(in_float(hn::IfThenElseZero(fits, set(1))), Floats(), fits_int64 + n);
  }
};

void in_tile(const TetrahedronBatch& batch, const glm::ivec3& first, const glm::i32vec3& signs, const glm::ivec3& size,
             TileTetrahedron (&tetrahedra)[kMost]) {
  constexpr double kWrong = 16 * 0x1p-53, kNudge = 1.0 / kNudgeSteps;
  const Doubles dd;
  const glm::i32vec3 nudged = nudge_steps(signs);
  const auto from = [&](int axis) { return set(first[axis] * double{kStepsPerVoxel} + nudged[axis] * kNudge); };
  const Vec3 origin{from(0), from(1), from(2)};
  const auto voxels = glm::vec3(size);
  FaceNumbers of[4];
  Boxes boxes;
  alignas(64) float flat[kMost];
  for (int n = 0; n < batch.count(); n += static_cast<int>(hn::Lanes(dd))) {
    const Vec3 d = corner(batch.deformed(), 3, n), a = corner(batch.deformed(), 0, n) - d,
               b = corner(batch.deformed(), 1, n) - d, c = corner(batch.deformed(), 2, n) - d, q = d - origin;
    boxes.find(batch, n, first, signs, size);
    const Vec3 bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
    const Double volume = dot(a, bc), sizes = sum(norm1(bc), norm1(ca), norm1(ab)), edge = largest(a),
                 wrong = hn::Mul(hn::Mul(set(kWrong), sizes), sum(largest(q), edge, set(2)));
    const auto thin = hn::Le(hn::Abs(volume), hn::Mul(hn::Mul(set(2 * kWrong), sizes), edge));
    hn::Store(in_float(hn::IfThenElseZero(thin, set(1))), Floats(), flat + n);
    const Double out = hn::IfThenElse(hn::Gt(volume, hn::Zero(dd)), set(1), set(-1)), in = hn::Neg(out);
    const auto scaled = [&](const Vec3& v, Double by) {
      return Vec3{hn::Mul(v.x, by), hn::Mul(v.y, by), hn::Mul(v.z, by)};
    };
    const Double at_bc = dot(bc, q), at_ca = dot(ca, q), at_ab = dot(ab, q);
    const auto put = [&](FaceNumbers& to, const Vec3& normal, Double value, Double by) {
      const Face face = row_face(scaled(normal, by), hn::Mul(value, by), in_float(wrong), voxels);
      const Floats df;
      hn::Store(face.at, df, to.at + n);
      hn::Store(face.along_y, df, to.along_y + n);
      hn::Store(face.along_z, df, to.along_z + n);
      hn::Store(face.error, df, to.error + n);
      hn::Store(face.normal, df, to.normal + n);
    };
    put(of[0], bc, at_bc, in);  // through D, away from A
    put(of[1], ca, at_ca, in);
    put(of[2], ab, at_ab, in);
    put(of[3], {sum(bc.x, ca.x, ab.x), sum(bc.y, ca.y, ab.y), sum(bc.z, ca.z, ab.z)},
        hn::Add(sum(at_bc, at_ca, at_ab), volume), out);
  }
  for (int n = 0; n < batch.count(); ++n) {
    TileTetrahedron& t = tetrahedra[n];
    for (int axis = 0; axis < 3; ++axis) {
      t.reached.begin[axis] = boxes.begin[axis][n];
      t.reached.end[axis] = boxes.end[axis][n];
    }
    t.fits_int64 = boxes.fits_int64[n] != 0;
    int lower = 0, upper = 4;
    for (const FaceNumbers& face : of) {
      t.faces.faces[face.normal[n] <= 0 ? lower++ : --upper] = {face.at[n], face.along_y[n], face.along_z[n],
                                                                face.error[n]};
    }
    t.faces.lower = flat[n] != 0 ? 0 : lower;
  }
}

void maps(const TetrahedronBatch& batch, const glm::ivec3& first, TileMaps& to) {
  constexpr double kThinnest = 0x1p-16, kSteepest = 128;
  const Doubles dd;
  alignas(64) std::int32_t at[3][kMost], along[3][3][kMost];
  alignas(64) float usable_at[kMost];
  for (int n = 0; n < batch.count(); n += static_cast<int>(hn::Lanes(dd))) {
    const Vec3 d = corner(batch.deformed(), 3, n), a = corner(batch.deformed(), 0, n) - d,
               b = corner(batch.deformed(), 1, n) - d, c = corner(batch.deformed(), 2, n) - d,
               of_d = corner(batch.u(), 3, n), of_a = corner(batch.u(), 0, n) - of_d,
               of_b = corner(batch.u(), 1, n) - of_d, of_c = corner(batch.u(), 2, n) - of_d;
    const Vec3 bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
    const Double det = dot(a, bc), inverse = hn::Div(set(1), det);
    auto usable =
        hn::Ge(hn::Abs(det), hn::Mul(set(kThinnest), hn::Mul(hn::Mul(norm1(a), norm1(b)), norm1(c))));  // NaN is not
    const auto middle = [&](Double of_a_axis, Double of_b_axis, Double of_c_axis, Double of_d_axis) {
      return hn::Floor(
          hn::Mul(hn::Add(sum(of_a_axis, of_b_axis, of_c_axis), hn::Mul(set(4), of_d_axis)), set(0x1p-14)));
    };
    const Vec3 o{middle(a.x, b.x, c.x, d.x), middle(a.y, b.y, c.y, d.y), middle(a.z, b.z, c.z, d.z)};
    const auto from_d = [&](Double voxels, Double steps) {
      return hn::Sub(hn::Mul(voxels, set(kStepsPerVoxel)), steps);
    };
    const Vec3 e{from_d(o.x, d.x), from_d(o.y, d.y), from_d(o.z, d.z)};
    const Vec3 tile{hn::Sub(set(first.x), o.x), hn::Sub(set(first.y), o.y), hn::Sub(set(first.z), o.z)};
    const auto axis = [&](int number, Double u_d, Double u_a, Double u_b, Double u_c) {
      const auto slope = [&](int way, Double along_bc, Double along_ca, Double along_ab, Double& steepness) {
        const Double any =
            hn::Mul(sum(hn::Mul(u_a, along_bc), hn::Mul(u_b, along_ca), hn::Mul(u_c, along_ab)), inverse);
        const auto gentle = hn::Lt(hn::Abs(any), set(kSteepest));
        usable = hn::And(usable, gentle);
        steepness = hn::IfThenElseZero(gentle, any);
        const Double rounded = hn::Round(hn::Mul(steepness, set(0x1p23)));
        hn::Store(hn::DemoteTo(Ints(), rounded), Ints(), along[way][number] + n);
        return rounded;
      };
      Vec3 g;
      const Double by_x = slope(0, bc.x, ca.x, ab.x, g.x), by_y = slope(1, bc.y, ca.y, ab.y, g.y),
                   by_z = slope(2, bc.z, ca.z, ab.z, g.z);
      const Double at_origin = hn::Round(hn::Mul(hn::Add(u_d, dot(g, e)), set(0x1p11)));
      const Double at_tile =
          hn::Add(at_origin, sum(hn::Mul(by_x, tile.x), hn::Mul(by_y, tile.y), hn::Mul(by_z, tile.z)));
      // Modulo 2^32; whole numbers below 2^53 are exact.
      const Double turns = hn::Floor(hn::Add(hn::Mul(at_tile, set(0x1p-32)), set(0.5)));
      hn::Store(hn::DemoteTo(Ints(), hn::Sub(at_tile, hn::Mul(turns, set(0x1p32)))), Ints(), at[number] + n);
    };
    axis(0, of_d.x, of_a.x, of_b.x, of_c.x);
    axis(1, of_d.y, of_a.y, of_b.y, of_c.y);
    axis(2, of_d.z, of_a.z, of_b.z, of_c.z);
    hn::Store(in_float(hn::IfThenElseZero(usable, set(1))), Floats(), usable_at + n);
  }
  for (int n = 0; n < batch.count(); ++n) {
    TileMap& map = to.map[n];
    to.is_thin[n] = usable_at[n] == 0;
    for (int number = 0; number < 3; ++number) {
      map.at[number] = at[number][n];
      for (int way = 0; way < 3; ++way) map.along[way][number] = along[way][number][n];
    }
  }
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(in_tile);
HWY_EXPORT(maps);

void TetrahedronBatch::add(std::uint64_t number, const Tetrahedron& t) {
  const int n = count_++;
  number_[n] = number;
  tetrahedra_[n] = t;
  const Vertex* corners[4] = {&t.a, &t.b, &t.c, &t.d};
  for (int which = 0; which < 4; ++which) {
    for (int axis = 0; axis < 3; ++axis) {
      deformed_.at[which][axis][n] = corners[which]->deformed[axis];
      u_.at[which][axis][n] = corners[which]->u[axis];
    }
  }
}

void find_in_tile(const TetrahedronBatch& batch, const glm::ivec3& first, const glm::i32vec3& signs,
                  const glm::ivec3& size, TileTetrahedron (&tetrahedra)[TetrahedronBatch::kMost]) {
  HWY_DYNAMIC_DISPATCH(in_tile)(batch, first, signs, size, tetrahedra);
}

void find_maps(const TetrahedronBatch& batch, const glm::ivec3& first, TileMaps& of) {
  HWY_DYNAMIC_DISPATCH(maps)(batch, first, of);
}

}  // namespace tetwarp::cpu

#endif
