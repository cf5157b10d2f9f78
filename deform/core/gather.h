#pragma once

#include "deform/core/barycentric.h"
#include "deform/core/ownership.h"
#include "deform/core/step_lattice.h"
#include "deform/core/visit_cell.h"

namespace tetwarp {

/// The other way round from `visit_cell`: from a voxel to the tetrahedron that owns it.
///
/// Nothing here decides ownership by itself. A tetrahedron is accepted where float arithmetic proves what
/// `side_of_face` would say, or exact integers say it; whatever cannot be settled is left to `visit_cell`. That the
/// owner found is the only one, and so the lowest, must be known before (docs/algorithm.md, "Gather").

/// A voxel centre, from the first vertex at rest, and its nudge; 2^-12 voxel, whole numbers and quarters in float.
struct GatherPoint {
  glm::vec3 steps, nudge;

  TETWARP_HD GatherPoint(const StepLattice& lattice, const glm::ivec3& voxel, const glm::i32vec3& signs)
      : steps(glm::vec3(voxel) * float{kStepsPerVoxel} - lattice.first),
        nudge(glm::vec3(nudge_steps(signs)) * (1.0f / kNudgeSteps)) {}
};

/// What one tetrahedron says of a voxel.
struct Trial {
  bool owns;            ///< certainly, and its weights need no exact arithmetic
  glm::vec3 u;          ///< where it owns: undeformed minus deformed place, voxels; the bits of `interpolate_u`
  glm::vec3 place;      ///< where its affine map takes the nudged voxel from, cells
  glm::vec3 per_slice;  ///< how far that moves from one voxel to the next along k, cells
};

namespace detail {

/// a b + c; fused on the device. For what need not be the same bits everywhere.
TETWARP_HD inline float multiply_add(float a, float b, float c) {
#ifdef __CUDA_ARCH__
  return fmaf(a, b, c);
#else
  return a * b + c;
#endif
}

/// 1 / x, rounded to nearest, for x of at least 2^-100 and at most 2^100 in size.
TETWARP_HD inline float reciprocal(float x) {
#ifdef __CUDA_ARCH__
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
#ifdef __CUDA_ARCH__
  return {fmaf(moved.x, -kVoxelsPerStep, 0.0f), fmaf(moved.y, -kVoxelsPerStep, 0.0f),
          fmaf(moved.z, -kVoxelsPerStep, 0.0f)};
#else
  return 0.0f - moved * kVoxelsPerStep;
#endif
}

/// Bound of the rounding errors of the four values that `try_tetrahedron` compares with it.
///
/// With unit roundoff 2^-24 and P the product of the sum norms of the three columns: a component of a cross product is
/// off by at most 2 units of its two products, a dot product by 3 more of its terms, the nudge adds 3 fused or 6 plain
/// operations; so det by 5 P, a numerator by 11 (|r| + |d|) times the norms of its two columns, and the value at D, the
/// difference of all four, by their sum and 3 roundings of at most the sum of their sizes.
TETWARP_HD inline float error_bound(float a, float b, float c, float r) {
  constexpr float kUnit = 1.0f / (1 << 24);
  const float bc = b * c;
  return (9.0f * kUnit) * (a * bc) + (15.0f * kUnit) * (r * (bc + a * (b + c)));
}

}  // namespace detail

/// Asks one tetrahedron for one voxel, in float.
///
/// Its corners relative to D, and the voxel relative to D, are exact. The numerators of the weights at p + d and what
/// they leave of the determinant are six times the volumes that decide ownership: it owns where all are positive by
/// more than their error. (An inverted tetrahedron is never accepted here.)
TETWARP_HD inline Trial try_tetrahedron(const StepLattice& lattice, const FloatTetrahedron& t,
                                        const GatherPoint& point) {
  const int dx = t.to.x < 0 ? -1 : 1, dy = t.to.y < 0 ? -lattice.row : lattice.row,
            dz = t.to.z < 0 ? -lattice.slice : lattice.slice;
  const int sum = dx + dy + dz;
  const glm::vec3* at_d = lattice.moved + t.offset;
  const glm::vec3 moved = at_d[0], moved_a = at_d[t.centre ? sum - dx : dx] - moved,
                  moved_b = at_d[t.centre ? sum - dy : dy] - moved, moved_c = at_d[t.centre ? sum - dz : dz] - moved;
  const glm::vec3 edge = t.to * lattice.cell;  // to the next vertex on each axis
  const glm::vec3 along = t.centre ? glm::vec3(0) : edge, across = t.centre ? edge : glm::vec3(0);
  const glm::vec3 a(along.x + moved_a.x, across.y + moved_a.y, across.z + moved_a.z);
  const glm::vec3 b(across.x + moved_b.x, along.y + moved_b.y, across.z + moved_b.z);
  const glm::vec3 c(across.x + moved_c.x, across.y + moved_c.y, along.z + moved_c.z);
  const glm::vec3 r = glm::vec3(detail::multiply_add(-t.d.x, lattice.cell.x, point.steps.x),
                                detail::multiply_add(-t.d.y, lattice.cell.y, point.steps.y),
                                detail::multiply_add(-t.d.z, lattice.cell.z, point.steps.z)) -
                      moved;  // exact

  const Cramer m(a, b, c);
  const float na = detail::dot(r, m.bc), nb = detail::dot(r, m.ca), nc = detail::dot(r, m.ab);
  const float qa = detail::nudged(na, point.nudge, m.bc), qb = detail::nudged(nb, point.nudge, m.ca),
              qc = detail::nudged(nc, point.nudge, m.ab);
  const float qd = ((m.det - qa) - qb) - qc;
  const float turn = t.to.x * t.to.y * t.to.z;  // of A, B, C when undeformed
  const float least = std::fmin(std::fmin(qa * turn, qb * turn), std::fmin(qc * turn, qd * turn));
  const float error = detail::error_bound(detail::norm1(a), detail::norm1(b), detail::norm1(c),
                                          detail::norm1(r) + 6.5f);  // 15 + 7 + 4 sixteenths of a step

  Trial trial;
  const float reciprocal = m.det != 0 ? detail::reciprocal(m.det) : 0.0f;  // flat: the next guess is D
  const Weights w{na * reciprocal, nb * reciprocal, nc * reciprocal};
  trial.owns = least > error && !is_thin(m, a, b, c) && w.within_slack();
  trial.u = detail::to_offset(blend(w, moved, moved_a, moved_b, moved_c));
  const glm::vec3 at_q = glm::vec3(qa, qb, qc) * reciprocal;
  const glm::vec3 slope = glm::vec3(m.bc.z, m.ca.z, m.ab.z) * (reciprocal * float{kStepsPerVoxel});
  const float all_q = (at_q.x + at_q.y) + at_q.z, all_slope = (slope.x + slope.y) + slope.z;
  const glm::vec3 shift = t.centre ? all_q - at_q : at_q, along_k = t.centre ? all_slope - slope : slope;
  trial.place = {detail::multiply_add(t.to.x, shift.x, t.d.x), detail::multiply_add(t.to.y, shift.y, t.d.y),
                 detail::multiply_add(t.to.z, shift.z, t.d.z)};
  trial.per_slice = t.to * along_k;
  return trial;
}

TETWARP_HD inline Trial try_tetrahedron(const StepLattice& lattice, const LatticeTetrahedron& t,
                                        const GatherPoint& point) {
  return try_tetrahedron(lattice, as_float(lattice, t), point);
}

/// Whether a tetrahedron owns a voxel, exactly. @param sides  the four sides that decide it, of the faces opposite A,
/// B, C, D
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

/// Calls `visit(voxel)` for every voxel of `region` that a tetrahedron of the lattice owns: what `visit_cell` reports
/// of it, with a float test in front of the exact one.
///
/// With the faces' values at q as in `try_tetrahedron`: inside where all are clear of their error on the inner side,
/// outside where one is clear of it on the other, exact integers in between. Inverted tetrahedra own like any other.
template <class Visit>
TETWARP_HD void visit_tetrahedron(const StepLattice& lattice, const LatticeTetrahedron& t, const VoxelBox& region,
                                  const Nudge& nudge, Visit&& visit) {
  const Tetrahedron exact = vertices_of(lattice, t);
  const VoxelBox voxels = detail::candidates(nudge, box_of(exact), region);
  if (detail::is_empty(voxels)) return;
  const glm::vec3 a(exact.a.deformed - exact.d.deformed), b(exact.b.deformed - exact.d.deformed),
      c(exact.c.deformed - exact.d.deformed);
  const Cramer m(a, b, c);
  const float turn = m.det < 0 ? -1.0f : 1.0f;
  const float la = detail::norm1(a), lb = detail::norm1(b), lc = detail::norm1(c);
  const glm::ivec3 begin(voxels.begin), end(voxels.end);
  for (int z = begin.z; z < end.z; ++z) {
    for (int y = begin.y; y < end.y; ++y) {
      for (int x = begin.x; x < end.x; ++x) {
        const glm::ivec3 voxel(x, y, z);
        const glm::i32vec3 steps = voxel * kStepsPerVoxel, signs = nudge.signs(glm::i64vec3(voxel));
        const glm::vec3 r(steps - exact.d.deformed), d = glm::vec3(nudge_steps(signs)) * (1.0f / kNudgeSteps);
        const float qa = detail::nudged(detail::dot(r, m.bc), d, m.bc),
                    qb = detail::nudged(detail::dot(r, m.ca), d, m.ca),
                    qc = detail::nudged(detail::dot(r, m.ab), d, m.ab), qd = ((m.det - qa) - qb) - qc;
        const float least = std::fmin(std::fmin(qa * turn, qb * turn), std::fmin(qc * turn, qd * turn));
        const float error = detail::error_bound(la, lb, lc, detail::norm1(r) + 6.5f);
        if (least < -error && detail::magnitude(m.det) > error) continue;
        int sides[4];
        if (least > error || owns_exactly(exact, steps, signs, sides)) visit(voxel);
      }
    }
  }
}

/// Walks from tetrahedron to tetrahedron, across a face that the voxel lies beyond, until one owns it, exactly.
///
/// @param start  where to begin  @param owner  the owner, where found  @return whether one was found within `most`
/// steps
TETWARP_HD inline bool walk_to_owner(const StepLattice& lattice, LatticeTetrahedron start, const glm::i32vec3& steps,
                                     const glm::i32vec3& signs, int most, LatticeTetrahedron& owner) {
  for (int n = 0; n < most; ++n) {
    const Tetrahedron t = vertices_of(lattice, start);
    int sides[4];
    if (owns_exactly(t, steps, signs, sides)) {
      owner = start;
      return true;
    }
    const Wide volume = signed_volume(Relative<Wide>(t.a.deformed), Relative<Wide>(t.b.deformed),
                                      Relative<Wide>(t.c.deformed), Relative<Wide>(t.d.deformed));
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
