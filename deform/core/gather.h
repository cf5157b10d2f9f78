// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/barycentric.h"
#include "deform/core/ownership.h"
#include "deform/core/step_lattice.h"
#include "deform/core/visit_cell.h"

namespace tetwarp {

// From a voxel to the tetrahedron that owns it: the opposite way of `visit_cell`, which goes from a cell to its voxels.
//
// Nothing here decides ownership by itself. A tetrahedron is accepted where float arithmetic proves the result of
// `side_of_face`, or exact integers compute it; whatever cannot be settled is left to `visit_cell`. That the owner
// found is the only one, and so has the lowest number, must be known before (docs/design, "Gather").

/// A voxel centre relative to the first undeformed vertex, and its nudge; 2^-12 voxel, in float, which holds both
/// exactly.
struct GatherPoint {
  glm::vec3 steps, nudge;

  TETWARP_HD GatherPoint(const StepLattice& lattice, const glm::ivec3& voxel, const glm::i32vec3& signs)
      : steps(glm::vec3(voxel) * float{kStepsPerVoxel} - lattice.first),
        nudge(glm::vec3(nudge_steps(signs)) * (1.0f / kNudgeSteps)) {}
};

/// What the test of one tetrahedron against one voxel found.
struct Trial {
  bool owns;    ///< whether it certainly owns the voxel and its weights need no exact arithmetic
  bool unsure;  ///< whether it may own the voxel and, tested with Effort::full, its weights need no exact arithmetic
  glm::vec3 moved;  ///< where it owns: deformed minus undeformed place, 2^-12 voxel
  FloatTetrahedron t;
  glm::vec3 weights;   ///< weights of A, B and C at the nudged voxel
  glm::vec3 slope;     ///< change of the weights along k, times the determinant
  float slope_factor;  ///< `slope` times this is the change of the weights from one voxel to the next along k

  /// If it owns the voxel: undeformed minus deformed place, voxels, with the bits of `interpolate_u`.
  TETWARP_HD glm::vec3 u() const;
  /// Undeformed place, in cells, that its affine map gives the nudged voxel.
  TETWARP_HD glm::vec3 place() const { return place_of(weights); }
  /// Undeformed place, in cells, that its affine map gives the next voxel along k.
  TETWARP_HD glm::vec3 next_place() const;

 private:
  TETWARP_HD glm::vec3 place_of(const glm::vec3& w) const;
};

namespace detail {

/// a b + c, fused on the device only; for numbers that need not have the same bits everywhere.
TETWARP_HD inline float multiply_add(float a, float b, float c) {
#ifdef TETWARP_ON_DEVICE
  return fmaf(a, b, c);
#else
  return a * b + c;
#endif
}

/// 1 / x, rounded to nearest, for x of at least 2^-100 and at most 2^100 in size.
TETWARP_HD inline float reciprocal(float x) {
#ifdef TETWARP_ON_DEVICE
  float guess;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(guess) : "f"(x));
  return fmaf(guess, fmaf(-x, guess, 1.0f), guess);  // what the division does once it knows the range
#else
  return 1.0f / x;
#endif
}

TETWARP_HD inline float nudged(float value, const glm::vec3& nudge, const Cross& n) {
  return multiply_add(nudge.x, n.x, multiply_add(nudge.y, n.y, multiply_add(nudge.z, n.z, value)));
}

/// u in voxels from how far a place has moved in steps: scaling by a power of two is exact; never -0.
TETWARP_HD inline glm::vec3 to_offset(const glm::vec3& moved) {
#ifdef TETWARP_ON_DEVICE
  return {fmaf(moved.x, -kVoxelsPerStep, 0.0f), fmaf(moved.y, -kVoxelsPerStep, 0.0f),
          fmaf(moved.z, -kVoxelsPerStep, 0.0f)};
#else
  return 0.0f - moved * kVoxelsPerStep;
#endif
}

constexpr float kUnit = 1.0f / (1 << 24);  ///< the largest relative error of rounding to float

/// Bound of the rounding errors of a determinant, of the numerators of its weights and of what they leave of it.
///
/// With P the product of the sum norms of the three columns: a component of a cross product is off by at most 2 units
/// of its two products, a dot product by 3 more of its terms, the nudge adds 3 fused or 6 plain operations; so det by
/// 5 P, a numerator by 11 (|r| + |d|) times the norms of its two columns, and the value at D, the difference of all
/// four, by their sum and 3 roundings of at most the sum of their sizes.
///
/// @param product  P  @param faces  sum of the products of two of the norms  @param r  |r| + |d|
TETWARP_HD inline float error_bound(float product, float faces, float r) {
  return (9.0f * kUnit) * product + (15.0f * kUnit) * (r * faces);
}

/// |d|: (15 + 7 + 4) / 16 steps.
constexpr float kNudgeNorm = 1.625f;

/// `error_bound` over s^2, from the sum s of the three norms and from |r|. P is at most s^3 / 27, and the sum of
/// products of two norms at most s^2 / 3.
TETWARP_HD inline float error_factor(float s, float r) {
  return multiply_add(s, kUnit / 3, multiply_add(r, 5 * kUnit, 5 * kNudgeNorm * kUnit));
}

/// `error_bound` over s^2 for any r, valid where the voxel is found to lie inside and the determinant exceeds both
/// kThinSum s^3 and kSlackSum s^2. Then weights have an error below 0.3 %, and |r| is at most the longest norm by the
/// weights, so less than 1.01 s; 6 is more than 1/3 + 5 * 1.01.
TETWARP_HD inline float error_factor(float s) { return multiply_add(s, 6 * kUnit, 5 * kNudgeNorm * kUnit); }

/// A determinant above kThinSum s^3 is not thin: P is at most s^3 / 27, here 26. Above kSlackSum s^2, no weight moves
/// by more than the slack between the nudged point and the voxel: 15/16 step times s^2 / 3 over 1/64 is 20 s^2.
constexpr float kThinSum = kThin / 26, kSlackSum = 22;

/// x, negated where an odd number of the signs `to` (+1 or -1) are negative.
TETWARP_HD inline float with_sign_of(float x, const glm::vec3& to) {
#ifdef TETWARP_ON_DEVICE
  const unsigned signs = __float_as_uint(to.x) ^ __float_as_uint(to.y) ^ __float_as_uint(to.z);
  return __uint_as_float(__float_as_uint(x) ^ (signs & 0x80000000u));
#else
  return x * (to.x * to.y * to.z);
#endif
}

}  // namespace detail

/// A tetrahedron and a voxel relative to its corner D; 2^-12 voxel, exact.
struct LocalTetrahedron {
  glm::vec3 moved;                      ///< how far D is displaced
  glm::vec3 moved_a, moved_b, moved_c;  ///< how much further A, B, C are
  glm::vec3 a, b, c, r;

  TETWARP_HD LocalTetrahedron(const StepLattice& lattice, const FloatTetrahedron& t, const GatherPoint& point) {
    using detail::multiply_add;
    const int dx = t.to.x < 0 ? -1 : 1, dy = t.to.y < 0 ? -lattice.row : lattice.row,
              dz = t.to.z < 0 ? -lattice.slice : lattice.slice;
    const int sum = dx + dy + dz;
    const glm::vec3 raised = lattice.raised(t.offset);
    moved = raised - lattice.packing.lift();
    moved_a = lattice.raised(t.offset + (t.centre ? sum - dx : dx)) - raised;
    moved_b = lattice.raised(t.offset + (t.centre ? sum - dy : dy)) - raised;
    moved_c = lattice.raised(t.offset + (t.centre ? sum - dz : dz)) - raised;
    const glm::vec3 edge = t.to * lattice.cell;  // from a vertex to the next on each axis
    const float along = t.centre ? 0.0f : 1.0f, across = t.centre ? 1.0f : 0.0f;
    const auto edge_to = [&edge](float x, float y, float z, const glm::vec3& by) {  // exact
      return glm::vec3(multiply_add(edge.x, x, by.x), multiply_add(edge.y, y, by.y), multiply_add(edge.z, z, by.z));
    };
    a = edge_to(along, across, across, moved_a);
    b = edge_to(across, along, across, moved_b);
    c = edge_to(across, across, along, moved_c);
    r = glm::vec3(multiply_add(-t.d.x, lattice.cell.x, point.steps.x),
                  multiply_add(-t.d.y, lattice.cell.y, point.steps.y),
                  multiply_add(-t.d.z, lattice.cell.z, point.steps.z)) -
        moved;
  }
};

/// How much is tried before a trial is left unsure. Closer error bounds are for large cells, where voxels are often
/// near a face; Effort::full looks at the weights too.
enum class Effort { quick, close, full };

TETWARP_HD inline glm::vec3 Trial::u() const { return detail::to_offset(moved); }

TETWARP_HD inline glm::vec3 Trial::place_of(const glm::vec3& w) const {
  using detail::multiply_add;
  const glm::vec3 shift = t.centre ? ((w.x + w.y) + w.z) - w : w;  // A of a centre lies along j and k from D
  return {multiply_add(t.to.x, shift.x, t.d.x), multiply_add(t.to.y, shift.y, t.d.y),
          multiply_add(t.to.z, shift.z, t.d.z)};
}

TETWARP_HD inline glm::vec3 Trial::next_place() const {
  using detail::multiply_add;
  return place_of({multiply_add(slope.x, slope_factor, weights.x), multiply_add(slope.y, slope_factor, weights.y),
                   multiply_add(slope.z, slope_factor, weights.z)});
}

/// Tests one tetrahedron against one voxel, in float.
///
/// The numerators of the weights at p + d, and the determinant minus their sum, are six times the volumes that decide
/// ownership; here they are divided by the determinant. A quotient has an error of 3 units of itself, and 1 minus their
/// sum one of 7 units where all are positive. So the tetrahedron owns the voxel where all four exceed the error of the
/// volumes, divided by the determinant, plus 8 units. The determinant must have the sign of the undeformed one: an
/// inverted tetrahedron is never accepted.
///
/// From p + d to p a weight changes by at most 15/16 step times the sum norms of two columns over the determinant.
/// Where that is clearly below the slack, and the weights at p + d are positive, no weight at p can leave it. With
/// Effort::full the weights themselves are looked at.
template <Effort kEffort>
TETWARP_HD Trial try_tetrahedron(const FloatTetrahedron& t, const LocalTetrahedron& local, const GatherPoint& point) {
  using detail::multiply_add;
  const Cramer m(local.a, local.b, local.c);
  const float na = detail::dot(local.r, m.bc), nb = detail::dot(local.r, m.ca), nc = detail::dot(local.r, m.ab);
  const float reciprocal = detail::reciprocal(m.det);  // flat: not finite, and owns nothing
  const glm::vec3 weights = glm::vec3(detail::nudged(na, point.nudge, m.bc), detail::nudged(nb, point.nudge, m.ca),
                                      detail::nudged(nc, point.nudge, m.ab)) *
                            reciprocal;
  const float least =
      std::fmin(std::fmin(weights.x, weights.y), std::fmin(weights.z, ((1.0f - weights.x) - weights.y) - weights.z));
  const float s = (detail::norm1(local.a) + detail::norm1(local.b)) + detail::norm1(local.c), squared = s * s;
  const float error =
      squared * (kEffort == Effort::quick ? detail::error_factor(s) : detail::error_factor(s, detail::norm1(local.r)));
  const float upright = detail::with_sign_of(m.det, t.to);  // A, B, C turn like that when undeformed
  const Weights w{na * reciprocal, nb * reciprocal, nc * reciprocal};
  const bool usable = kEffort == Effort::full
                          ? (upright > detail::kThinSum * (squared * s)) & w.within_slack()
                          : upright > squared * multiply_add(detail::kThinSum, s, detail::kSlackSum);

  Trial trial;
  const float bound = multiply_add(error, detail::magnitude(reciprocal), 8 * detail::kUnit);
  trial.owns = (least > bound) & usable;
  trial.unsure = (least >= -bound) & (least <= bound) & usable;
  trial.moved = blend(w, local.moved, local.moved_a, local.moved_b, local.moved_c);
  trial.t = t;
  trial.weights = weights;
  trial.slope = {m.bc.z, m.ca.z, m.ab.z};
  trial.slope_factor = reciprocal * float{kStepsPerVoxel};
  return trial;
}

/// @param t  of the lattice
TETWARP_HD inline Trial try_tetrahedron(const StepLattice& lattice, const FloatTetrahedron& t,
                                        const GatherPoint& point) {
  return try_tetrahedron<Effort::full>(t, LocalTetrahedron(lattice, t, point), point);
}
TETWARP_HD inline Trial try_tetrahedron(const StepLattice& lattice, const LatticeTetrahedron& t,
                                        const GatherPoint& point) {
  return try_tetrahedron(lattice, as_float(lattice, t), point);
}

/// u at a voxel that the tetrahedron owns: the bits of `interpolate_u`.
TETWARP_HD inline glm::vec3 offset_in(const StepLattice& lattice, const LatticeTetrahedron& t, const glm::ivec3& voxel,
                                      const glm::i32vec3& signs) {
  const LocalTetrahedron local(lattice, as_float(lattice, t), GatherPoint(lattice, voxel, signs));
  const Cramer m(local.a, local.b, local.c);
  if (!is_thin(m, local.a, local.b, local.c)) {
    const float reciprocal = detail::reciprocal(m.det);
    const Weights w{detail::dot(local.r, m.bc) * reciprocal, detail::dot(local.r, m.ca) * reciprocal,
                    detail::dot(local.r, m.ab) * reciprocal};
    if (w.within_slack()) return detail::to_offset(blend(w, local.moved, local.moved_a, local.moved_b, local.moved_c));
  }
  return interpolate_u_exactly(vertices_of(lattice, t), voxel * kStepsPerVoxel, signs);
}

/// Whether a tetrahedron owns a voxel, by exact integers.
/// @param sides  set to the sides of the faces opposite A, B, C, D on which the voxel lies
template <class Int>
TETWARP_HD bool owns_exactly(const Tetrahedron& t, const glm::i32vec3& steps, const glm::i32vec3& signs,
                             int (&sides)[4]) {
  const Relative<Int> a(t.a.deformed - steps), b(t.b.deformed - steps), c(t.c.deformed - steps),
      d(t.d.deformed - steps);
  const VoxelNudge<Int> nudge(signs);
  sides[0] = side_of_face(b, c, d, nudge);
  sides[1] = side_of_face(a, d, c, nudge);
  sides[2] = side_of_face(a, b, d, nudge);
  sides[3] = side_of_face(a, c, b, nudge);
  return sides[0] != 0 && sides[1] == sides[0] && sides[2] == sides[0] && sides[3] == sides[0];
}

TETWARP_HD inline bool owns_exactly(const Tetrahedron& t, const glm::i32vec3& steps, const glm::i32vec3& signs,
                                    int (&sides)[4]) {
  Box box = box_of(t);
  box.grow(steps);
  if (fits_double(box)) return owns_exactly<double>(t, steps, signs, sides);
  if (fits_int64(box)) return owns_exactly<std::int64_t>(t, steps, signs, sides);
  return owns_exactly<Wide>(t, steps, signs, sides);
}

/// Half-open box of voxels in 32 bits.
struct IntBox {
  glm::ivec3 begin, end;

  TETWARP_HD bool is_empty() const { return end.x <= begin.x || end.y <= begin.y || end.z <= begin.z; }
};

/// Narrows a half-open range of voxels on one axis to those that a tetrahedron or cell between `low` and `high` (2^-12
/// voxel) may own, as `detail::candidates` does.
TETWARP_HD inline void cut_to_candidates(const NudgeTurns& turns, int axis, std::int32_t low, std::int32_t high,
                                         int& begin, int& end) {
  int first = low >> 12, last = high >> 12;
  if ((first << 12) != low || turns.sign(axis, first) < 0) ++first;
  if ((last << 12) == high && turns.sign(axis, last) > 0) --last;
  begin = begin > first ? begin : first;
  end = end < last + 1 ? end : last + 1;
}

/// The part of a box that a tetrahedron or cell between `low` and `high` (2^-12 voxel) may own.
TETWARP_HD inline IntBox candidates(const NudgeTurns& turns, const glm::i32vec3& low, const glm::i32vec3& high,
                                    IntBox box) {
  for (int axis = 0; axis < 3; ++axis)
    cut_to_candidates(turns, axis, low[axis], high[axis], box.begin[axis], box.end[axis]);
  return box;
}

/// Calls `visit(voxel)` for each voxel of `region` that a tetrahedron of the lattice owns and for which `wanted(voxel)`
/// holds. It reports what `visit_cell` reports of that tetrahedron, but tests in float first.
///
/// With values of the faces at q as in `try_tetrahedron`: a voxel is inside where all values clear their error on the
/// inner side, outside where one clears it on the outer side; in between exact integers decide. Inverted tetrahedra own
/// like any other.
template <class Wanted, class Visit>
TETWARP_HD void visit_tetrahedron(const StepLattice& lattice, const LatticeTetrahedron& t, const IntBox& region,
                                  const NudgeTurns& turns, Wanted&& wanted, Visit&& visit) {
  const glm::vec3 moved = lattice.moved(lattice.offset(t.d));
  const auto edge = [&](const glm::ivec3& to) {
    return glm::vec3(to - t.d) * lattice.cell + (lattice.moved(lattice.offset(to)) - moved);
  };
  const glm::vec3 a = edge(t.a()), b = edge(t.b()), c = edge(t.c());
  const glm::vec3 low = glm::min(glm::min(a, b), glm::min(c, glm::vec3(0))),
                  high = glm::max(glm::max(a, b), glm::max(c, glm::vec3(0)));
  const glm::i32vec3 rest = glm::i32vec3(lattice.first) + t.d * glm::i32vec3(lattice.cell);
  const IntBox voxels = candidates(turns, rest + glm::i32vec3(moved + low), rest + glm::i32vec3(moved + high), region);
  if (voxels.is_empty()) return;
  const Cramer m(a, b, c);
  const float turn = m.det < 0 ? -1.0f : 1.0f;
  const float la = detail::norm1(a), lb = detail::norm1(b), lc = detail::norm1(c);
  const glm::i32vec3 at_d = rest + glm::i32vec3(moved);
  for (int z = voxels.begin.z; z < voxels.end.z; ++z) {
    for (int y = voxels.begin.y; y < voxels.end.y; ++y) {
      for (int x = voxels.begin.x; x < voxels.end.x; ++x) {
        const glm::ivec3 voxel(x, y, z);
        if (!wanted(voxel)) continue;
        const glm::i32vec3 steps = voxel * kStepsPerVoxel, signs = turns.signs(voxel);
        const glm::vec3 r(steps - at_d), d = glm::vec3(nudge_steps(signs)) * (1.0f / kNudgeSteps);
        const float qa = detail::nudged(detail::dot(r, m.bc), d, m.bc),
                    qb = detail::nudged(detail::dot(r, m.ca), d, m.ca),
                    qc = detail::nudged(detail::dot(r, m.ab), d, m.ab), qd = ((m.det - qa) - qb) - qc;
        const float least = std::fmin(std::fmin(qa * turn, qb * turn), std::fmin(qc * turn, qd * turn));
        const float error =
            detail::error_bound((la * lb) * lc, lb * lc + la * (lb + lc), detail::norm1(r) + detail::kNudgeNorm);
        if (least < -error && detail::magnitude(m.det) > error) continue;
        int sides[4];
        if (least > error || owns_exactly(vertices_of(lattice, t), steps, signs, sides)) visit(voxel);
      }
    }
  }
}

/// Walks from tetrahedron to tetrahedron, each time across a face beyond which the voxel lies, until one owns it by
/// exact integers.
///
/// @param lattice  what `vertices_of` takes
/// @param start    where the walk begins
/// @param owner    set to the owner, if it is found
/// @return whether it was found within `most` moves
template <class Lattice>
TETWARP_HD bool walk_to_owner(const Lattice& lattice, LatticeTetrahedron start, const glm::i32vec3& steps,
                              const glm::i32vec3& signs, int most, LatticeTetrahedron& owner) {
  for (int n = 0; n < most; ++n) {
    const Tetrahedron t = vertices_of(lattice, start);
    int sides[4];
    if (owns_exactly(t, steps, signs, sides)) {
      owner = start;
      return true;
    }
    const float volume = detail::edge_determinant(t.a.deformed - t.d.deformed, t.b.deformed - t.d.deformed,
                                                  t.c.deformed - t.d.deformed);  // its sign is exact
    const int inner = volume > 0 ? -1 : 1;
    bool moved = false;
    for (int k = 0; k < 4 && !moved; ++k) {
      const int face = (n + k) & 3;  // another one first each time: no voxel goes round in circles for long
      if (sides[face] == inner) continue;
      const LatticeTetrahedron next = start.across(face);
      const glm::ivec3 cell = next.cell();
      moved = cell.x >= 0 && cell.y >= 0 && cell.z >= 0 && cell.x < lattice.cells.x && cell.y < lattice.cells.y &&
              cell.z < lattice.cells.z;
      if (moved) start = next;
    }
    if (!moved) return false;
  }
  return false;
}

}  // namespace tetwarp
