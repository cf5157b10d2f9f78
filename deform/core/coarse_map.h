// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/barycentric.h"
#include "deform/core/sample.h"

namespace tetwarp {

constexpr int kFixedBits = 23;  ///< u of a coarse field is a whole number of 2^-23 voxel
constexpr std::int64_t kFixedOne = std::int64_t{1} << kFixedBits;
/// Where a vertex moves as far as this on an axis, 2^-12 voxel, 32 bits may not hold U.
constexpr int kFarForInt32 = 255 * kStepsPerVoxel;

/// u = undeformed minus deformed place over one tetrahedron of a coarse field, in whole numbers of 2^-23 voxel
/// (docs/design/definition.md, "Coarse fields"):
///
///     U(p) = at_origin + slope[0] (p - origin).x + slope[1] (p - origin).y + slope[2] (p - origin).z
///
/// It is made in double, each operation rounded once, in the order in which it stands here; from then on all is whole
/// numbers, so any way to add them up gives the same bits.
struct CoarseMap {
  glm::ivec3 origin{0};       ///< o: a voxel near the middle of the tetrahedron
  glm::i32vec3 slope[3]{};    ///< g: how U changes from voxel to voxel along i, j, k
  glm::i64vec3 at_origin{0};  ///< k: U at the origin
  bool is_thin = true;        ///< whether this map is not usable; then `thin_u` gives U

  CoarseMap() = default;
  TETWARP_HD explicit CoarseMap(const Tetrahedron& t)
      : CoarseMap(in_double(t.a.deformed - t.d.deformed), in_double(t.b.deformed - t.d.deformed),
                  in_double(t.c.deformed - t.d.deformed), t.d.deformed, in_double(t.d.u), in_double(t.a.u - t.d.u),
                  in_double(t.b.u - t.d.u), in_double(t.c.u - t.d.u)) {}

  /// All arguments are whole numbers of steps, 2^-12 voxel.
  /// @param a, b, c         edges from D to A, B and C, deformed
  /// @param d               D, deformed
  /// @param ud, ua, ub, uc  u of D, and by how much those of A, B and C exceed it
  TETWARP_HD CoarseMap(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::i32vec3& d,
                       const glm::dvec3& ud, const glm::dvec3& ua, const glm::dvec3& ub, const glm::dvec3& uc) {
    constexpr double kThinnest = 0x1p-16, kSteepest = 128;
    const glm::dvec3 bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
    const double det = (a.x * bc.x + a.y * bc.y) + a.z * bc.z;
    const double inverse = 1.0 / det;
    bool usable = std::fabs(det) >= kThinnest * ((norm1(a) * norm1(b)) * norm1(c));  // NaN is not
    glm::dvec3 e;
    for (int axis = 0; axis < 3; ++axis) {
      const double at_d = detail::whole_in_double(d[axis]), corners = ((a[axis] + b[axis]) + c[axis]) + 4 * at_d,
                   middle = detail::floor_to_whole(corners * 0x1p-14);  // 4 corners, 2^12 steps a voxel
      origin[axis] = static_cast<int>(detail::nearest_whole(middle));
      e[axis] = middle * kStepsPerVoxel - at_d;
    }
    glm::dvec3 steepness[3], beside;
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3& of = steepness[axis];
      for (int along = 0; along < 3; ++along) {
        of[along] = ((ua[axis] * bc[along] + ub[axis] * ca[along]) + uc[axis] * ab[along]) * inverse;
        usable = usable && std::fabs(of[along]) < kSteepest;
      }
      beside[axis] = ud[axis] + ((of.x * e.x + of.y * e.y) + of.z * e.z);
    }
    if (!usable) return;
    is_thin = false;
    for (int axis = 0; axis < 3; ++axis) {
      for (int along = 0; along < 3; ++along)
        slope[along][axis] = static_cast<std::int32_t>(detail::nearest_whole(steepness[axis][along] * 0x1p23));
      at_origin[axis] = detail::nearest_whole(beside[axis] * 0x1p11);
    }
  }

  /// U at a voxel. Only for a map that `is_thin` does not forbid.
  TETWARP_HD glm::i64vec3 u(const glm::ivec3& voxel) const {
    const glm::i64vec3 from(voxel - origin);
    return at_origin +
           (glm::i64vec3(slope[0]) * from.x + glm::i64vec3(slope[1]) * from.y + glm::i64vec3(slope[2]) * from.z);
  }

 private:
  TETWARP_HD static glm::dvec3 in_double(const glm::i32vec3& v) {
    return {detail::whole_in_double(v.x), detail::whole_in_double(v.y), detail::whole_in_double(v.z)};
  }
  TETWARP_HD static glm::dvec3 cross(const glm::dvec3& p, const glm::dvec3& q) {
    return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
  }
  TETWARP_HD static double norm1(const glm::dvec3& v) { return (std::fabs(v.x) + std::fabs(v.y)) + std::fabs(v.z); }
};

/// U at a voxel of a thin or very steep tetrahedron of a coarse field, 2^-23 voxel: from exact determinants, rounded.
TETWARP_HD inline glm::i64vec3 thin_u(const Tetrahedron& t, const glm::ivec3& voxel, const glm::i32vec3& signs) {
  const glm::dvec3 steps = exact_u_in_steps(t, voxel * kStepsPerVoxel, signs);
  return {static_cast<std::int64_t>(std::rint(steps.x * 0x1p11)),
          static_cast<std::int64_t>(std::rint(steps.y * 0x1p11)),
          static_cast<std::int64_t>(std::rint(steps.z * 0x1p11))};
}

/// U at a voxel that a tetrahedron of a coarse field owns, 2^-23 voxel.
/// @param signs  directions in which the voxel is nudged
TETWARP_HD inline glm::i64vec3 coarse_u(const Tetrahedron& t, const glm::ivec3& voxel, const glm::i32vec3& signs) {
  const CoarseMap map(t);
  return map.is_thin ? thin_u(t, voxel, signs) : map.u(voxel);
}

/// U as an offset of whole voxels and a fraction.
TETWARP_HD inline FixedOffset fixed_offset(const glm::i64vec3& u) {
  constexpr std::int64_t kFraction = kFixedOne - 1;
  return {glm::i32vec3(u >> glm::i64vec3(kFixedBits)),
          glm::vec3(static_cast<float>(u.x & kFraction), static_cast<float>(u.y & kFraction),
                    static_cast<float>(u.z & kFraction)) *
              0x1p-23f};
}

}  // namespace tetwarp
