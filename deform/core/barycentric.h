#pragma once

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

TETWARP_HD inline float magnitude(float x) { return x < 0 ? -x : x; }

/// Sum of the absolute values of the six products of det(a, b, c): what its rounding error is proportional to.
TETWARP_HD inline float permanent(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const float x = magnitude(b.y * c.z) + magnitude(b.z * c.y);
  const float y = magnitude(b.z * c.x) + magnitude(b.x * c.z);
  const float z = magnitude(b.x * c.y) + magnitude(b.y * c.x);
  return (magnitude(a.x) * x + magnitude(a.y) * y) + magnitude(a.z) * z;
}

/// det of three differences about D, exact; `r` in nudge units or steps.
TETWARP_HD inline Wide determinant(const glm::i64vec3& a, const glm::i64vec3& b, const glm::i64vec3& c) {
  return Wide(a.x) * (Wide(b.y) * c.z - Wide(b.z) * c.y) + Wide(a.y) * (Wide(b.z) * c.x - Wide(b.x) * c.z) +
         Wide(a.z) * (Wide(b.x) * c.y - Wide(b.y) * c.x);
}

}  // namespace detail

/// How far a weight may leave [0, 1] at the voxel before u is taken at the nudged point, where it cannot.
constexpr double kWeightSlack = 1.0 / 64;
/// Below this part of its permanent, a float determinant has too few right digits.
constexpr float kThin = 1.0f / 256;

/// u at a voxel of a thin or very small tetrahedron: weights exact before their division, about D.
///
/// The owner holds the nudged point q, not p: where the tetrahedron is so small that a weight at p leaves [0, 1] by
/// more than the slack, the affine map would be extrapolated far beyond the tetrahedron, so it is evaluated at q.
TETWARP_HD inline glm::vec3 interpolate_u_exactly(const Tetrahedron& t, const glm::i32vec3& steps,
                                                  const glm::i32vec3& signs) {
  const glm::i64vec3 origin(t.d.deformed);
  const glm::i64vec3 a = glm::i64vec3(t.a.deformed) - origin, b = glm::i64vec3(t.b.deformed) - origin;
  const glm::i64vec3 c = glm::i64vec3(t.c.deformed) - origin;
  const double volume = to_double(detail::determinant(a, b, c)) * kNudgeSteps;
  glm::i64vec3 r = (glm::i64vec3(steps) - origin) * std::int64_t{kNudgeSteps};
  double wa = 0, wb = 0, wc = 0;
  for (int attempt = 0; attempt < 2; ++attempt) {
    wa = to_double(detail::determinant(r, b, c)) / volume;
    wb = to_double(detail::determinant(a, r, c)) / volume;
    wc = to_double(detail::determinant(a, b, r)) / volume;
    const double wd = ((1 - wa) - wb) - wc;
    if (wa >= -kWeightSlack && wb >= -kWeightSlack && wc >= -kWeightSlack && wd >= -kWeightSlack) break;
    r += glm::i64vec3(nudge_steps(signs));
  }
  glm::vec3 u;
  for (int axis = 0; axis < 3; ++axis) {
    const double ud = t.d.u[axis];
    const double value = ((ud + wa * (t.a.u[axis] - ud)) + wb * (t.b.u[axis] - ud)) + wc * (t.c.u[axis] - ud);
    u[axis] = static_cast<float>(value * (1.0 / kStepsPerVoxel));
  }
  return u;
}

/// u = undeformed minus deformed position at a voxel that the tetrahedron owns, in voxels of output index.
///
/// Barycentric weights about D solve [A-D B-D C-D] (b_A, b_B, b_C)^T = p - D (paper Eq. 13), here by Cramer's rule.
/// About D each entry is about one cell long, so float suffices: for the corners of Eq. 8 the determinant is 1.216
/// here, and 2.01 when the 4x4 form of Eq. 6 is evaluated in float. Then u = u_D + b_A (u_A - u_D) + b_B (u_B - u_D) +
/// b_C (u_C - u_D) (Eq. 7 rewritten): a tetrahedron that is only translated gives its translation exactly, whatever the
/// weights' rounding.
///
/// @param steps  the voxel, 2^-12 voxel
/// @param signs  which way it is nudged
TETWARP_HD inline glm::vec3 interpolate_u(const Tetrahedron& t, const glm::i32vec3& steps, const glm::i32vec3& signs) {
  const glm::vec3 a = detail::to_voxels(t.a.deformed - t.d.deformed),
                  b = detail::to_voxels(t.b.deformed - t.d.deformed);
  const glm::vec3 c = detail::to_voxels(t.c.deformed - t.d.deformed), r = detail::to_voxels(steps - t.d.deformed);
  const detail::Cross bc = detail::cross(b, c);
  const float det = detail::dot(a, bc);
  if (!(detail::magnitude(det) > kThin * detail::permanent(a, b, c))) return interpolate_u_exactly(t, steps, signs);
  const float wa = detail::dot(r, bc) / det;
  const float wb = detail::dot(r, detail::cross(c, a)) / det;
  const float wc = detail::dot(r, detail::cross(a, b)) / det;
  const float wd = ((1.0f - wa) - wb) - wc;
  constexpr float kLeast = -static_cast<float>(kWeightSlack);
  if (!(wa >= kLeast && wb >= kLeast && wc >= kLeast && wd >= kLeast)) return interpolate_u_exactly(t, steps, signs);
  const glm::vec3 ud = detail::to_voxels(t.d.u);
  const glm::vec3 ua = detail::to_voxels(t.a.u - t.d.u), ub = detail::to_voxels(t.b.u - t.d.u),
                  uc = detail::to_voxels(t.c.u - t.d.u);
  return {((ud.x + wa * ua.x) + wb * ub.x) + wc * uc.x, ((ud.y + wa * ua.y) + wb * ub.y) + wc * uc.y,
          ((ud.z + wa * ua.z) + wb * ub.z) + wc * uc.z};
}

}  // namespace tetwarp
