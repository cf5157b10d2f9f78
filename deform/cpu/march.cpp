// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/march.h"

// Compiled once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/march.cpp"
#include <hwy/foreach_target.h>
// After it, as Highway asks.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "deform/cpu/vector_snap-inl.h"

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

using IntMask = hn::Mask<Ints>;

HWY_INLINE Int set(int value) { return hn::Set(Ints(), value); }

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

/// `Trial`, one a lane.
struct Trials {
  FloatMask owns;
  Vec3 moved;  ///< where it owns: deformed minus undeformed place, steps
  Tetrahedra t;
  Vec3 to, weights;
  Cross3 bc, ca, ab;
  Float factor;  ///< from a component of these to how much a weight changes from voxel to voxel

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
  const Float zero = hn::Zero(Floats());
  const Tetrahedra t(lattice, place);
  const Vec3 to = t.to();
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
  const Vec3 a{hn::Add(edge_along.x, further_a.x), hn::Add(edge_across.y, further_a.y),
               hn::Add(edge_across.z, further_a.z)};
  const Vec3 b{hn::Add(edge_across.x, further_b.x), hn::Add(edge_along.y, further_b.y),
               hn::Add(edge_across.z, further_b.z)};
  const Vec3 c{hn::Add(edge_across.x, further_c.x), hn::Add(edge_across.y, further_c.y),
               hn::Add(edge_along.z, further_c.z)};
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
      hn::Mul(reciprocal, set(float{kStepsPerVoxel}))};
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

class Marcher {
 public:
  Marcher(const VectorField& field, const NudgeTurns& turns, const MarchTile& tile, MarchScratch& scratch)
      : field_(field), turns_(turns), tile_(tile), scratch_(scratch), size_(tile.box.end - tile.box.begin) {}

  void run() {
    scratch_.unsettled.clear();
    seed();
    with_snapping(field_, [&](auto snapping) {
      constexpr Snapping kSnapping = decltype(snapping)::value;
      slice<kSnapping, true>(0);
      for (int k = 1; k < size_.z; ++k) slice<kSnapping, false>(k);
    });
  }

 private:
  static constexpr int kRow = static_cast<int>(kTile);
  static constexpr int kSeedTries = 40;               ///< from an undeformed guess
  static constexpr int kFirstTries = 16, kTries = 6;  ///< of voxels that failed, at the first slice and at others
  static constexpr int kWholeSteps = 3;  ///< tries; then half steps, for in folds whole ones may go round in circles

  /// Guesses for the first row: where the middle of the first slice comes from, by repeated prediction.
  void seed() {
    const StepLattice& lattice = field_.lattice;
    const glm::ivec3 middle(size_.x / 2, size_.y / 2, 0), voxel = tile_.box.begin + middle;
    const glm::vec3 place = lattice.place(glm::vec3(voxel));
    MarchScratch::Queue& queue = scratch_.queue;
    queue.count = 1;
    queue.voxel[0] = middle.x + kRow * middle.y;
    queue.x[0] = place.x;
    queue.y[0] = place.y;
    queue.z[0] = place.z;
    const int column = middle.x + kRow * middle.y;
    for (int n = 0; n < kSeedTries && queue.count != 0; ++n) again<false>(n);
    const glm::vec3 found = queue.count == 0 ? glm::vec3(scratch_.x[column], scratch_.y[column], scratch_.z[column])
                                             : glm::vec3(queue.x[0], queue.y[0], queue.z[0]);
    queue.count = 0;
    for (int i = 0; i < kRow; ++i) {
      const glm::vec3 guess = found + glm::vec3(i - middle.x, -middle.y, 0) * lattice.voxel;
      scratch_.x[i] = guess.x;
      scratch_.y[i] = guess.y;
      scratch_.z[i] = guess.z;
    }
  }

  /// @tparam kFirst  each row is predicted from the row before, the first one is given
  template <Snapping kSnapping, bool kFirst>
  void slice(int k) {
    const Floats df;
    const Ints di;
    const hn::Rebind<std::uint8_t, Floats> d8;
    const auto lanes = static_cast<int>(hn::Lanes(df));
    const PointAxis z(set(tile_.box.begin.z + k), field_, turns_, 2, kNudgeZ);
    for (int j = 0; j < size_.y; ++j) {
      const PointAxis y(set(tile_.box.begin.y + j), field_, turns_, 1, kNudgeY);
      const int first = (k * size_.y + j) * size_.x;
      for (int i = 0; i < size_.x; i += lanes) {
        const int column = kRow * j + i;
        float *const at_x = scratch_.x + column, *const at_y = scratch_.y + column, *const at_z = scratch_.z + column;
        const Vec3 place{hn::LoadU(df, at_x), hn::LoadU(df, at_y), hn::LoadU(df, at_z)};
        const auto* owners = reinterpret_cast<const std::uint8_t*>(tile_.owners) + first + i;
        const IntMask wanted = hn::And(hn::Eq(hn::PromoteTo(di, hn::LoadU(d8, owners)), set(1)),
                                       hn::FirstN(di, static_cast<std::size_t>(size_.x - i)));
        Vec3 next = place;
        if (hn::AllFalse(di, wanted)) {
          const Float step_y = set(field_.lattice.voxel.y);
          if (kFirst && j + 1 < size_.y) store(at_x + kRow, {place.x, hn::Add(place.y, step_y), place.z});
          next.z = hn::Add(place.z, set(field_.lattice.voxel.z));
        } else {
          const PointAxis x(numbers_from(tile_.box.begin.x + i), field_, turns_, 0, kNudgeX);
          const auto trials = try_tetrahedra<kSnapping, Effort::close>(field_, place, {x.steps, y.steps, z.steps},
                                                                       {x.nudge, y.nudge, z.nudge});
          prefetch(trials.t.at_d);
          const Vec3 offset = to_offset(trials.moved);
          hn::StoreInterleaved3(offset.x, offset.y, offset.z, df, &tile_.offset[first + i].x);
          const IntMask failed = hn::AndNot(hn::RebindMask(di, trials.owns), wanted);
          if (!hn::AllFalse(di, failed)) push(numbers_from(column + kRow * kRow * k), trials.place(), failed);
          if (kFirst && j + 1 < size_.y) store(at_x + kRow, trials.next_along_j());
          next = trials.next_along_k();
        }
        store(at_x, next);
      }
    }
    for (int n = 0; n < (kFirst ? kFirstTries : kTries) && scratch_.queue.count != 0; ++n) again<true>(n);
    give_up();
  }

  /// @param x  of a column in scratch_.x
  void store(float* x, const Vec3& place) {
    const Floats df;
    const auto column = x - scratch_.x;
    hn::StoreU(place.x, df, x);
    hn::StoreU(place.y, df, scratch_.y + column);
    hn::StoreU(place.z, df, scratch_.z + column);
  }

  /// Asks for vertices two slices on, near which the march will be.
  void prefetch(Int vertices) const {
    const std::int64_t last = std::int64_t{field_.lattice.slice} * (field_.lattice.cells.z + 1) - 1;
    const std::int64_t vertex = std::int64_t{hn::GetLane(vertices)} + 2 * std::int64_t{field_.lattice.slice};
    const auto* line = reinterpret_cast<const char*>(field_.displacement + std::min(vertex, last));
    constexpr int kLine = 64;
    for (int n = 0; n * kLine < static_cast<int>(hn::Lanes(Floats()) * sizeof(glm::vec3)); ++n)
      hwy::Prefetch(line + n * kLine);
  }

  void push(Int voxels, const Vec3& place, IntMask which) {
    const Floats df;
    const Ints di;
    MarchScratch::Queue& queue = scratch_.queue;
    const FloatMask of_floats = hn::RebindMask(df, which);
    // Compressed in registers: some processors are very slow to compress into memory.
    hn::StoreU(hn::Compress(place.x, of_floats), df, queue.x + queue.count);
    hn::StoreU(hn::Compress(place.y, of_floats), df, queue.y + queue.count);
    hn::StoreU(hn::Compress(place.z, of_floats), df, queue.z + queue.count);
    hn::StoreU(hn::Compress(voxels, which), di, queue.voxel + queue.count);
    queue.count += static_cast<int>(hn::CountTrue(di, which));
  }

  /// Tries all that is in the queue once more. @tparam kWrite  offsets too; otherwise only places
  template <bool kWrite>
  void again(int attempt) {
    const Floats df;
    const Ints di;
    const auto lanes = static_cast<int>(hn::Lanes(df));
    MarchScratch::Queue& queue = scratch_.queue;
    const int count = queue.count;
    queue.count = 0;
    for (int n = 0; n < count; n += lanes) {
      const Int voxels = hn::LoadU(di, queue.voxel + n);
      const Vec3 place{hn::LoadU(df, queue.x + n), hn::LoadU(df, queue.y + n), hn::LoadU(df, queue.z + n)};
      const IntMask here = hn::FirstN(di, static_cast<std::size_t>(count - n));
      const Int inside = hn::IfThenElseZero(here, voxels);
      const auto axis = [&](Int in, int which, int size) {
        return PointAxis(hn::Add(in, set(tile_.box.begin[which])), field_, turns_, which, size);
      };
      constexpr int kBits = 5;
      static_assert(kRow == 1 << kBits);
      const Int mask = set(kRow - 1);
      const PointAxis x = axis(hn::And(inside, mask), 0, kNudgeX),
                      y = axis(hn::And(hn::ShiftRight<kBits>(inside), mask), 1, kNudgeY),
                      z = axis(hn::ShiftRight<2 * kBits>(inside), 2, kNudgeZ);
      const auto trials = try_tetrahedra<Snapping::in_double, Effort::full>(field_, place, {x.steps, y.steps, z.steps},
                                                                            {x.nudge, y.nudge, z.nudge});
      const IntMask owns = hn::And(hn::RebindMask(di, trials.owns), here);
      if (!hn::AllFalse(di, owns)) settle<kWrite>(voxels, owns, trials);
      const Vec3 whole = trials.place();
      const Float half = set(0.5f);
      push(voxels,
           attempt < kWholeSteps
               ? whole
               : Vec3{hn::Mul(hn::Add(whole.x, place.x), half), hn::Mul(hn::Add(whole.y, place.y), half),
                      hn::Mul(hn::Add(whole.z, place.z), half)},
           hn::AndNot(owns, here));
    }
  }

  template <bool kWrite>
  void settle(Int voxels, IntMask owns, const Trials& trials) {
    const Floats df;
    const Ints di;
    alignas(64) std::int32_t voxel[MarchScratch::kRoom], owned[MarchScratch::kRoom];
    alignas(64) float offset[3 * MarchScratch::kRoom], next[3 * MarchScratch::kRoom];
    hn::Store(voxels, di, voxel);
    hn::Store(hn::IfThenElseZero(owns, set(1)), di, owned);
    const Vec3 u = to_offset(trials.moved), place = kWrite ? trials.next_along_k() : trials.place();
    hn::StoreInterleaved3(u.x, u.y, u.z, df, offset);
    hn::StoreInterleaved3(place.x, place.y, place.z, df, next);
    for (int n = 0; n < static_cast<int>(hn::Lanes(df)); ++n) {
      if (owned[n] == 0) continue;
      const int column = voxel[n] % (kRow * kRow), k = voxel[n] / (kRow * kRow);
      scratch_.x[column] = next[3 * n];
      scratch_.y[column] = next[3 * n + 1];
      scratch_.z[column] = next[3 * n + 2];
      if (kWrite)
        tile_.offset[(k * size_.y + column / kRow) * size_.x + column % kRow] = {offset[3 * n], offset[3 * n + 1],
                                                                                 offset[3 * n + 2]};
    }
  }

  void give_up() {
    MarchScratch::Queue& queue = scratch_.queue;
    for (int n = 0; n < queue.count; ++n)
      scratch_.unsettled.push_back({queue.voxel[n], {queue.x[n], queue.y[n], queue.z[n]}});
    queue.count = 0;
  }

  const VectorField& field_;
  const NudgeTurns& turns_;
  const MarchTile& tile_;
  MarchScratch& scratch_;
  glm::ivec3 size_;
};

void march_tile(const VectorField& field, const NudgeTurns& nudge, const MarchTile& tile, MarchScratch& scratch) {
  Marcher(field, nudge, tile, scratch).run();
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(march_tile);

void march(const VectorField& field, const NudgeTurns& nudge, const MarchTile& tile, MarchScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(march_tile)(field, nudge, tile, scratch);
}

}  // namespace tetwarp::cpu

#endif
