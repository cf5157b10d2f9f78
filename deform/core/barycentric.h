// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <initializer_list>

#include "deform/core/five_tetrahedra.h"

namespace tetwarp {

namespace detail {

struct Cross {
  float x, y, z;
};
TETWARP_HD inline Cross cross(const glm::vec3& a, const glm::vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
TETWARP_HD inline float dot(const glm::vec3& a, const Cross& n) { return (a.x * n.x + a.y * n.y) + a.z * n.z; }

TETWARP_HD inline glm::vec3 to_voxels(const glm::i32vec3& steps) {
  return {static_cast<float>(steps.x) * kVoxelsPerStep, static_cast<float>(steps.y) * kVoxelsPerStep,
          static_cast<float>(steps.z) * kVoxelsPerStep};
}

TETWARP_HD inline float magnitude(float x) { return std::fabs(x); }

/// Length of a vector in the sum norm; the product of three bounds what a determinant's rounding error grows with.
TETWARP_HD inline float norm1(const glm::vec3& v) { return (magnitude(v.x) + magnitude(v.y)) + magnitude(v.z); }

/// Determinant of three differences about D, exact, in the unit of the arguments.
TETWARP_HD inline Wide determinant(const glm::i64vec3& a, const glm::i64vec3& b, const glm::i64vec3& c) {
  return Wide(a.x) * (Wide(b.y) * c.z - Wide(b.z) * c.y) + Wide(a.y) * (Wide(b.z) * c.x - Wide(b.x) * c.z) +
         Wide(a.z) * (Wide(b.x) * c.y - Wide(b.y) * c.x);
}

}  // namespace detail

namespace detail {

/// Determinant of three edges, exact before it is rounded to float. It is rarely called, and so is kept out of loops.
TETWARP_NOINLINE_HD inline float exact_determinant(glm::i64vec3 a, glm::i64vec3 b, glm::i64vec3 c) {
  return static_cast<float>(to_double(determinant(a, b, c)));
}

/// Determinant of three edges whose components are whole numbers of steps below 2^24. It is computed in float where
/// that certainly has the right sign, and exactly otherwise; so its sign and its zero are always right.
///
/// A component of a cross product has an error of at most 2 units (2^-24) of its two products; the dot product adds at
/// most 3.
TETWARP_HD inline float edge_determinant(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  constexpr float kError = 8.0f / (1 << 24);
  const float det = dot(a, cross(b, c));
  if (magnitude(det) > kError * ((norm1(a) * norm1(b)) * norm1(c))) return det;
  return exact_determinant(glm::i64vec3(a), glm::i64vec3(b), glm::i64vec3(c));
}

/// Determinant of three edges of any length in steps, with the right sign and the right zero.
TETWARP_HD inline float edge_determinant(const glm::i32vec3& a, const glm::i32vec3& b, const glm::i32vec3& c) {
  constexpr int kExact = 1 << 24;  // floats hold all whole numbers up to here
  for (const glm::i32vec3& edge : {a, b, c}) {
    if (edge.x <= -kExact || edge.x >= kExact || edge.y <= -kExact || edge.y >= kExact || edge.z <= -kExact ||
        edge.z >= kExact) {
      return exact_determinant(glm::i64vec3(a), glm::i64vec3(b), glm::i64vec3(c));
    }
  }
  return edge_determinant(glm::vec3(a), glm::vec3(b), glm::vec3(c));
}

}  // namespace detail

/// Whether an undeformed tetrahedron has less volume than 1/64 of the product of its edges' sum norms; then float has
/// too few digits for its Jacobian determinant. For a corner tetrahedron of a cube the share is 1, for its centre 1/4.
/// @param a, b, c  edges about D, in any unit
TETWARP_HD inline bool is_thin_at_rest(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  constexpr float kThinnest = 1.0f / 64;
  using detail::norm1;
  return !(detail::magnitude(detail::dot(a, detail::cross(b, c))) >= kThinnest * ((norm1(a) * norm1(b)) * norm1(c)));
}

/// Jacobian determinant of the forward map of a tetrahedron, deformed over undeformed volume, as reports and maps of
/// all backends state it. It is negative exactly where the tetrahedron is inverted, zero exactly where it has no volume
/// when deformed, and not finite where it has no undeformed volume.
///
/// Both volumes are computed in float (`edge_determinant`), so that vector units can do it. The error is 5 units
/// (2^-24) of the product of the edges' sum norms over the volume, for each of both: about 1e-6 for a cell that is
/// about as thick as wide. Where the undeformed tetrahedron is thin that would be too much; there both volumes are
/// exact before the division.
TETWARP_HD inline float forward_jacobian(const Tetrahedron& t) {
  const glm::i32vec3 a = t.a.deformed - t.d.deformed, b = t.b.deformed - t.d.deformed, c = t.c.deformed - t.d.deformed,
                     rest_a = a + (t.a.u - t.d.u), rest_b = b + (t.b.u - t.d.u), rest_c = c + (t.c.u - t.d.u);
  if (is_thin_at_rest(glm::vec3(rest_a), glm::vec3(rest_b), glm::vec3(rest_c))) return static_cast<float>(jacobian(t));
  return detail::edge_determinant(a, b, c) / detail::edge_determinant(rest_a, rest_b, rest_c) + 0.0f;  // never -0
}

/// Jacobian determinants of the five tetrahedra of a cell.
TETWARP_HD inline void cell_jacobians(const Cell& cell, bool odd, float (&jacobians)[kTetrahedraPerCell]) {
  for (int number = 0; number < kTetrahedraPerCell; ++number)
    jacobians[number] = forward_jacobian(tetrahedron_of(cell, number, odd));
}

/// How far a weight may leave [0, 1] at the voxel before u is taken at the nudged point, where it cannot.
constexpr double kWeightSlack = 1.0 / 64;
/// Below this part of the product of its columns' sum norms, a float determinant has too few right digits.
constexpr float kThin = 1.0f / 256;

/// Cramer's rule for [A-D B-D C-D] (b_A, b_B, b_C)^T = r (paper Eq. 13), in float, in any unit of length.
///
/// About D each entry is about one cell long, so float suffices: for the corners of Eq. 8 the determinant is 1.216
/// here, and 2.01 when the 4x4 form of Eq. 6 is evaluated in float.
struct Cramer {
  detail::Cross bc, ca, ab;
  float det;

  TETWARP_HD Cramer(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c)
      : bc(detail::cross(b, c)), ca(detail::cross(c, a)), ab(detail::cross(a, b)), det(detail::dot(a, bc)) {}
};

/// Whether float has too few digits for the weights of a tetrahedron with these edges about D.
TETWARP_HD inline bool is_thin(const Cramer& m, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  return !(detail::magnitude(m.det) > kThin * ((detail::norm1(a) * detail::norm1(b)) * detail::norm1(c)));
}

/// Barycentric weights of A, B and C; the weight of D is 1 minus their sum.
struct Weights {
  float a, b, c;

  TETWARP_HD float d() const { return ((1.0f - a) - b) - c; }
  /// Whether none is below -kWeightSlack.
  TETWARP_HD bool within_slack() const {
    constexpr float kLeast = -static_cast<float>(kWeightSlack);
    return a >= kLeast && b >= kLeast && c >= kLeast && d() >= kLeast;
  }
};

/// u = u_D + b_A (u_A - u_D) + b_B (u_B - u_D) + b_C (u_C - u_D) (Eq. 7 rewritten).
///
/// @param ud, a, b, c  u at D, and the differences from it at A, B, C
TETWARP_HD inline glm::vec3 blend(const Weights& w, const glm::vec3& ud, const glm::vec3& a, const glm::vec3& b,
                                  const glm::vec3& c) {
  return {((ud.x + w.a * a.x) + w.b * b.x) + w.c * c.x, ((ud.y + w.a * a.y) + w.b * b.y) + w.c * c.y,
          ((ud.z + w.a * a.z) + w.b * b.z) + w.c * c.z};
}

/// Barycentric weights in double, exact before their division.
struct ExactWeights {
  double a, b, c;

  TETWARP_HD double d() const { return ((1 - a) - b) - c; }
};

/// Weights at a voxel of a thin or very small tetrahedron.
///
/// The owner holds the nudged point q, not p. Where the tetrahedron is so small that a weight at p leaves [0, 1] by
/// more than kWeightSlack, the affine map would be extrapolated far beyond the tetrahedron, so it is evaluated at q.
TETWARP_HD inline ExactWeights exact_weights(const Tetrahedron& t, const glm::i32vec3& steps,
                                             const glm::i32vec3& signs) {
  const glm::i64vec3 origin(t.d.deformed);
  const glm::i64vec3 a = glm::i64vec3(t.a.deformed) - origin, b = glm::i64vec3(t.b.deformed) - origin;
  const glm::i64vec3 c = glm::i64vec3(t.c.deformed) - origin;
  const double volume = to_double(detail::determinant(a, b, c)) * kNudgeSteps;
  glm::i64vec3 r = (glm::i64vec3(steps) - origin) * std::int64_t{kNudgeSteps};
  ExactWeights w{};
  for (int attempt = 0; attempt < 2; ++attempt) {
    w.a = to_double(detail::determinant(r, b, c)) / volume;
    w.b = to_double(detail::determinant(a, r, c)) / volume;
    w.c = to_double(detail::determinant(a, b, r)) / volume;
    if (w.a >= -kWeightSlack && w.b >= -kWeightSlack && w.c >= -kWeightSlack && w.d() >= -kWeightSlack) break;
    r += glm::i64vec3(nudge_steps(signs));
  }
  return w;
}

/// u at a voxel of a thin or very small tetrahedron, 2^-12 voxel, by `exact_weights`.
TETWARP_HD inline glm::dvec3 exact_u_in_steps(const Tetrahedron& t, const glm::i32vec3& steps,
                                              const glm::i32vec3& signs) {
  const ExactWeights w = exact_weights(t, steps, signs);
  glm::dvec3 u;
  for (int axis = 0; axis < 3; ++axis) {
    const double ud = t.d.u[axis];
    u[axis] = ((ud + w.a * (t.a.u[axis] - ud)) + w.b * (t.b.u[axis] - ud)) + w.c * (t.c.u[axis] - ud);
  }
  return u;
}

/// The same in voxels, rounded to float.
TETWARP_HD inline glm::vec3 interpolate_u_exactly(const Tetrahedron& t, const glm::i32vec3& steps,
                                                  const glm::i32vec3& signs) {
  return glm::vec3(exact_u_in_steps(t, steps, signs) * (1.0 / kStepsPerVoxel));
}

/// Whether an edge from D is so long that float may not hold the place of a voxel relative to D, in 2^-12 voxel.
TETWARP_HD inline bool is_long(const Tetrahedron& t) {
  constexpr int kLong = (1 << 24) - (1 << 18);  // room for the voxels of a tile around
  for (const glm::i32vec3& edge :
       {t.a.deformed - t.d.deformed, t.b.deformed - t.d.deformed, t.c.deformed - t.d.deformed}) {
    if (edge.x <= -kLong || edge.x >= kLong || edge.y <= -kLong || edge.y >= kLong || edge.z <= -kLong ||
        edge.z >= kLong) {
      return true;
    }
  }
  return false;
}

/// The affine map of a tetrahedron, made once, so that u of its voxels is interpolated without reading the vertices
/// again.
///
/// Weights are computed in float by `Cramer` and blended by `blend`: a tetrahedron that is only translated gives its
/// translation exactly, however the weights are rounded.
class TetrahedronMap {
 public:
  TETWARP_HD explicit TetrahedronMap(const Tetrahedron& t)
      : TetrahedronMap(t, detail::to_voxels(t.a.deformed - t.d.deformed),
                       detail::to_voxels(t.b.deformed - t.d.deformed), detail::to_voxels(t.c.deformed - t.d.deformed)) {
  }

  /// u = undeformed minus deformed position at a voxel that the tetrahedron owns, in voxels of output index.
  ///
  /// @param steps    the voxel, 2^-12 voxel
  /// @param exactly  gives `interpolate_u_exactly`, where float has too few digits
  template <class Exactly>
  TETWARP_HD glm::vec3 u(const glm::i32vec3& steps, Exactly&& exactly) const {
    if (is_exact_) return exactly();
    const glm::vec3 r = detail::to_voxels(steps - d_);
    const Weights w{detail::dot(r, cramer_.bc) * reciprocal_, detail::dot(r, cramer_.ca) * reciprocal_,
                    detail::dot(r, cramer_.ab) * reciprocal_};
    if (!w.within_slack()) return exactly();
    return blend(w, u_, u_a_, u_b_, u_c_);
  }

 private:
  TETWARP_HD TetrahedronMap(const Tetrahedron& t, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c)
      : d_(t.d.deformed),
        cramer_(a, b, c),
        is_exact_(is_thin(cramer_, a, b, c) || is_long(t)),
        reciprocal_(1.0f / cramer_.det),
        u_(detail::to_voxels(t.d.u)),
        u_a_(detail::to_voxels(t.a.u - t.d.u)),
        u_b_(detail::to_voxels(t.b.u - t.d.u)),
        u_c_(detail::to_voxels(t.c.u - t.d.u)) {}

  glm::i32vec3 d_;
  Cramer cramer_;
  bool is_exact_;                  ///< whether float has too few digits for all voxels
  float reciprocal_;               ///< 1 / determinant
  glm::vec3 u_, u_a_, u_b_, u_c_;  ///< u at D, and the differences from it at A, B and C, voxels
};

/// u = undeformed minus deformed place at a voxel that the tetrahedron owns, in voxels of output index.
///
/// @param steps  the voxel, 2^-12 voxel
/// @param signs  directions in which it is nudged
TETWARP_HD inline glm::vec3 interpolate_u(const Tetrahedron& t, const glm::i32vec3& steps, const glm::i32vec3& signs) {
  return TetrahedronMap(t).u(steps, [&] { return interpolate_u_exactly(t, steps, signs); });
}

}  // namespace tetwarp
