// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/host_device.h"

namespace tetwarp::bench {

template <class Real>
struct Point {
  Real x, y, z;
};

/// Corners A, B, C, D of a tetrahedron in voxels.
template <class Real>
struct Corners {
  Point<Real> a, b, c, d;
};

template <class Real>
struct Barycentric {
  Real a, b, c, d;
};

/// det [A B C D; 1 1 1 1] (Eq. 6), expanded along the first row by minors of differences: it multiplies coordinates as
/// large as the volume and takes the products off each other, which in float leaves noise. The order in which the paper
/// writes it multiplies three coordinates and leaves more (bench/paper/appendix.h).
template <class Real>
TETWARP_HD Real determinant_4x4(const Corners<Real>& t) {
  const auto minor = [](const Point<Real>& p, const Point<Real>& q, const Point<Real>& r) {  // of rows y, z, 1
    return p.y * (q.z - r.z) - q.y * (p.z - r.z) + r.y * (p.z - q.z);
  };
  return t.a.x * minor(t.b, t.c, t.d) - t.b.x * minor(t.a, t.c, t.d) + t.c.x * minor(t.a, t.b, t.d) -
         t.d.x * minor(t.a, t.b, t.c);
}

/// det [A-D B-D C-D] (Eq. 13): the entries are about one cell long wherever the cell lies.
template <class Real>
TETWARP_HD Real determinant_about_d(const Corners<Real>& t) {
  const Point<Real> a{t.a.x - t.d.x, t.a.y - t.d.y, t.a.z - t.d.z}, b{t.b.x - t.d.x, t.b.y - t.d.y, t.b.z - t.d.z},
      c{t.c.x - t.d.x, t.c.y - t.d.y, t.c.z - t.d.z};
  return a.x * (b.y * c.z - c.y * b.z) - b.x * (a.y * c.z - c.y * a.z) + c.x * (a.y * b.z - b.y * a.z);
}

/// Eq. 6: (b_A, b_B, b_C, b_D) = [A B C D; 1 1 1 1]^-1 (p, 1), the general inverse of a 4 x 4 matrix by cofactors.
/// Not finite where the tetrahedron has no volume.
template <class Real>
TETWARP_HD Barycentric<Real> barycentric_4x4(const Corners<Real>& t, const Point<Real>& p) {
  const Real m[4][4] = {{t.a.x, t.b.x, t.c.x, t.d.x},
                        {t.a.y, t.b.y, t.c.y, t.d.y},
                        {t.a.z, t.b.z, t.c.z, t.d.z},
                        {Real(1), Real(1), Real(1), Real(1)}};
  // 2 x 2 determinants of the upper two rows (s) and the lower two (c)
  const Real s0 = m[0][0] * m[1][1] - m[1][0] * m[0][1], s1 = m[0][0] * m[1][2] - m[1][0] * m[0][2],
             s2 = m[0][0] * m[1][3] - m[1][0] * m[0][3], s3 = m[0][1] * m[1][2] - m[1][1] * m[0][2],
             s4 = m[0][1] * m[1][3] - m[1][1] * m[0][3], s5 = m[0][2] * m[1][3] - m[1][2] * m[0][3];
  const Real c0 = m[2][0] * m[3][1] - m[3][0] * m[2][1], c1 = m[2][0] * m[3][2] - m[3][0] * m[2][2],
             c2 = m[2][0] * m[3][3] - m[3][0] * m[2][3], c3 = m[2][1] * m[3][2] - m[3][1] * m[2][2],
             c4 = m[2][1] * m[3][3] - m[3][1] * m[2][3], c5 = m[2][2] * m[3][3] - m[3][2] * m[2][3];
  const Real r = Real(1) / (s0 * c5 - s1 * c4 + s2 * c3 + s3 * c2 - s4 * c1 + s5 * c0);
  const Real inverse[4][4] = {
      {(m[1][1] * c5 - m[1][2] * c4 + m[1][3] * c3) * r, (-m[0][1] * c5 + m[0][2] * c4 - m[0][3] * c3) * r,
       (m[3][1] * s5 - m[3][2] * s4 + m[3][3] * s3) * r, (-m[2][1] * s5 + m[2][2] * s4 - m[2][3] * s3) * r},
      {(-m[1][0] * c5 + m[1][2] * c2 - m[1][3] * c1) * r, (m[0][0] * c5 - m[0][2] * c2 + m[0][3] * c1) * r,
       (-m[3][0] * s5 + m[3][2] * s2 - m[3][3] * s1) * r, (m[2][0] * s5 - m[2][2] * s2 + m[2][3] * s1) * r},
      {(m[1][0] * c4 - m[1][1] * c2 + m[1][3] * c0) * r, (-m[0][0] * c4 + m[0][1] * c2 - m[0][3] * c0) * r,
       (m[3][0] * s4 - m[3][1] * s2 + m[3][3] * s0) * r, (-m[2][0] * s4 + m[2][1] * s2 - m[2][3] * s0) * r},
      {(-m[1][0] * c3 + m[1][1] * c1 - m[1][2] * c0) * r, (m[0][0] * c3 - m[0][1] * c1 + m[0][2] * c0) * r,
       (-m[3][0] * s3 + m[3][1] * s1 - m[3][2] * s0) * r, (m[2][0] * s3 - m[2][1] * s1 + m[2][2] * s0) * r}};
  const auto row = [&](int n) {
    return inverse[n][0] * p.x + inverse[n][1] * p.y + inverse[n][2] * p.z + inverse[n][3];
  };
  return {row(0), row(1), row(2), row(3)};
}

/// Eq. 13: (b_A, b_B, b_C) = [A-D B-D C-D]^-1 (p - D), b_D the rest of 1. Not finite where there is no volume.
template <class Real>
TETWARP_HD Barycentric<Real> barycentric_about_d(const Corners<Real>& t, const Point<Real>& p) {
  const Point<Real> a{t.a.x - t.d.x, t.a.y - t.d.y, t.a.z - t.d.z}, b{t.b.x - t.d.x, t.b.y - t.d.y, t.b.z - t.d.z},
      c{t.c.x - t.d.x, t.c.y - t.d.y, t.c.z - t.d.z}, v{p.x - t.d.x, p.y - t.d.y, p.z - t.d.z};
  const Real bc_x = b.y * c.z - b.z * c.y, bc_y = b.z * c.x - b.x * c.z, bc_z = b.x * c.y - b.y * c.x;
  const Real ca_x = c.y * a.z - c.z * a.y, ca_y = c.z * a.x - c.x * a.z, ca_z = c.x * a.y - c.y * a.x;
  const Real ab_x = a.y * b.z - a.z * b.y, ab_y = a.z * b.x - a.x * b.z, ab_z = a.x * b.y - a.y * b.x;
  const Real r = Real(1) / (a.x * bc_x + a.y * bc_y + a.z * bc_z);
  const Real at_a = (bc_x * r) * v.x + (bc_y * r) * v.y + (bc_z * r) * v.z;
  const Real at_b = (ca_x * r) * v.x + (ca_y * r) * v.y + (ca_z * r) * v.z;
  const Real at_c = (ab_x * r) * v.x + (ab_y * r) * v.y + (ab_z * r) * v.z;
  return {at_a, at_b, at_c, Real(1) - at_a - at_b - at_c};
}

}  // namespace tetwarp::bench
