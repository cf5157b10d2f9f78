// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The tetrahedra that hold undeformed places, one a lane, and how far their vertices moved; included once for each
// instruction set (Highway's -inl.h files).
#if defined(TETWARP_VECTOR_TETRAHEDRA_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TETWARP_VECTOR_TETRAHEDRA_INL_H_
#undef TETWARP_VECTOR_TETRAHEDRA_INL_H_
#else
#define TETWARP_VECTOR_TETRAHEDRA_INL_H_
#endif

#include <hwy/highway.h>

#include "deform/cpu/march.h"
#include "deform/cpu/vector_snap-inl.h"

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

using IntMask = hn::Mask<Ints>;

HWY_INLINE Int set(int value) { return hn::Set(Ints(), value); }

/// `FloatTetrahedron`, one a lane.
struct Tetrahedra {
  Vec3 d;                      ///< vertices D
  Int at_d, at_a, at_b, at_c;  ///< numbers of the vertices
  FloatMask down_x, down_y, down_z, centre;

  /// Those that hold undeformed places: `tetrahedron_at`.
  HWY_INLINE Tetrahedra(const StepLattice& lattice, const Vec3& place) {
    const Floats df;
    const Ints di;
    const Float zero = hn::Zero(df), one = set(1.0f);
    const auto on_axis = [&](Float from, int last, Float& in) {
      const Float above = hn::IfThenElseZero(hn::Gt(from, zero), from);  // NaN: 0
      const Float cell = hn::Min(hn::Floor(above), set(static_cast<float>(last)));
      in = hn::Min(hn::Sub(above, cell), one);
      return cell;
    };
    Float in_x, in_y, in_z;
    const Vec3 cell{on_axis(place.x, lattice.last.x, in_x), on_axis(place.y, lattice.last.y, in_y),
                    on_axis(place.z, lattice.last.z, in_z)};
    const Int x = hn::ConvertTo(di, cell.x), y = hn::ConvertTo(di, cell.y), z = hn::ConvertTo(di, cell.z);
    const FloatMask odd = hn::RebindMask(df, hn::TestBit(hn::Xor(hn::Xor(x, y), z), set(1)));
    const Float mirrored = hn::IfThenElse(odd, hn::Sub(one, in_x), in_x);  // mirrored, an odd cell is an even one
    const Float other = hn::Sub(one, in_y), low = hn::Sub(other, in_z), high = hn::Add(other, in_z);
    const FloatMask corner0 = hn::Lt(mirrored, low), corner6 = hn::Lt(mirrored, hn::Neg(low)),
                    corner3 = hn::Gt(mirrored, high), corner5 = hn::Gt(mirrored, hn::Sub(set(2.0f), high));
    const FloatMask down35 = hn::Or(corner3, corner5);
    centre = hn::Not(hn::Or(hn::Or(corner0, corner6), down35));
    const FloatMask even_centre = hn::AndNot(odd, centre);
    down_x = hn::Xor(hn::Xor(down35, odd), centre);
    down_y = hn::Or(even_centre, hn::Or(corner3, corner6));
    down_z = hn::Or(even_centre, hn::Or(corner5, corner6));
    d = {hn::Add(cell.x, hn::IfThenElseZero(down_x, one)), hn::Add(cell.y, hn::IfThenElseZero(down_y, one)),
         hn::Add(cell.z, hn::IfThenElseZero(down_z, one))};

    const Int row = set(lattice.row), slice = set(lattice.slice);
    const IntMask ix = hn::RebindMask(di, down_x), iy = hn::RebindMask(di, down_y), iz = hn::RebindMask(di, down_z),
                  ic = hn::RebindMask(di, centre);
    const Int first = hn::Add(hn::Add(hn::Mul(z, slice), hn::Mul(y, row)), x);
    at_d = hn::Add(hn::Add(hn::Add(first, hn::IfThenElseZero(ix, set(1))), hn::IfThenElseZero(iy, row)),
                   hn::IfThenElseZero(iz, slice));
    const Int dx = hn::IfThenElse(ix, set(-1), set(1)), dy = hn::IfThenElse(iy, hn::Neg(row), row),
              dz = hn::IfThenElse(iz, hn::Neg(slice), slice);
    const Int sum = hn::Add(hn::Add(dx, dy), dz);
    at_a = hn::Add(at_d, hn::IfThenElse(ic, hn::Sub(sum, dx), dx));
    at_b = hn::Add(at_d, hn::IfThenElse(ic, hn::Sub(sum, dy), dy));
    at_c = hn::Add(at_d, hn::IfThenElse(ic, hn::Sub(sum, dz), dz));
  }

  /// +1 or -1: where A, B, C lie from D.
  HWY_INLINE Vec3 to() const {
    const Float up = set(1.0f), down = set(-1.0f);
    return {hn::IfThenElse(down_x, down, up), hn::IfThenElse(down_y, down, up), hn::IfThenElse(down_z, down, up)};
  }
};

#if HWY_TARGET != HWY_SCALAR
/// Blocks of four floats, `load(n)`, `load(n + 4)` and so on.
template <class D, class Load>
HWY_INLINE auto every_fourth(D d, const Load& load, int n) {
  if constexpr (hn::MaxLanes(D()) <= 4) {
    return load(n);
  } else {
    const hn::Half<D> half;
    constexpr int kNext = static_cast<int>(hn::MaxLanes(D()) / 2);
    return hn::Combine(d, every_fourth(half, load, n + kNext), every_fourth(half, load, n));
  }
}
#endif

HWY_INLINE Vec3 gathered(const glm::vec3* displacement, Int number) {
  const Floats df;
  const Int index = hn::Add(hn::Add(number, number), number);
  const float* first = &displacement->x;
  return {hn::GatherIndex(df, first, index), hn::GatherIndex(df, first + 1, index),
          hn::GatherIndex(df, first + 2, index)};
}

/// The displacements of the vertices with these numbers. Vertex by vertex, four floats at a time: some processors make
/// gathers of so many steps that nothing else runs beside them.
/// @param last  number of the last vertex, after which nothing may be read
HWY_INLINE Vec3 displacements(const glm::vec3* displacement, Int number, int last) {
#if HWY_TARGET == HWY_SCALAR
  static_cast<void>(last);
  return gathered(displacement, number);
#else
  const Floats df;
  if (HWY_UNLIKELY(!hn::AllFalse(Ints(), hn::Eq(number, set(last))))) return gathered(displacement, number);
  HWY_ALIGN std::int32_t at[MarchScratch::kRoom];
  hn::Store(number, Ints(), at);
  const hn::Full128<float> block;
  const auto load = [&](int n) { return hn::LoadU(block, &displacement[at[n]].x); };
  const Float r0 = every_fourth(df, load, 0), r1 = every_fourth(df, load, 1), r2 = every_fourth(df, load, 2),
              r3 = every_fourth(df, load, 3);
  const hn::RepartitionToWide<Floats> pairs;
  const auto wide = [&](Float v) { return hn::BitCast(pairs, v); };
  const Float low0 = hn::InterleaveLower(df, r0, r1), low1 = hn::InterleaveLower(df, r2, r3),
              high0 = hn::InterleaveUpper(df, r0, r1), high1 = hn::InterleaveUpper(df, r2, r3);
  return {hn::BitCast(df, hn::InterleaveLower(pairs, wide(low0), wide(low1))),
          hn::BitCast(df, hn::InterleaveUpper(pairs, wide(low0), wide(low1))),
          hn::BitCast(df, hn::InterleaveLower(pairs, wide(high0), wide(high1)))};
#endif
}

/// How far the vertices with these numbers moved, steps.
template <Snapping kSnapping>
HWY_INLINE Vec3 moved_vertices(const VectorField& field, Int number, const Vec3& at, FloatMask& certain) {
  return moved_steps<kSnapping>(field, displacements(field.displacement, number, field.last_vertex()), at, certain);
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#endif  // the toggle
