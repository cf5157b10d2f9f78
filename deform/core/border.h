// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/step_lattice.h"

namespace tetwarp {

/// A triangle of the deformed border of a lattice, corners in 2^-12 voxel. Its outer side is that of (b - a) x (c - a)
/// while the lattice is undeformed.
///
/// The winding number of the border around a voxel is the number of tetrahedra that own the voxel, inverted ones
/// counted as -1 (docs/design, "Gather"). It is found row by row, from where the row passes through these
/// triangles.
struct BorderTriangle {
  glm::i32vec3 a, b, c;
};

/// One of the two triangles of a border face.
///
/// Of the four corners of a face, the two even ones are corners D of tetrahedra. Each gives the triangle of D and its
/// two neighbours in the face.
/// @param lattice  what `vertices_of` takes
/// @param axis     axis (0 to 2) across which the side of the lattice lies
/// @param high     whether the side is the one at the high end of the axis
/// @param face     position in the side, in cells along the two axes that follow `axis`
/// @param which    0 or 1
template <class Lattice>
TETWARP_HD BorderTriangle border_triangle(const Lattice& lattice, int axis, bool high, const glm::ivec2& face,
                                          int which) {
  const int next = (axis + 1) % 3, last = (axis + 2) % 3;
  glm::ivec3 d(0);
  d[axis] = high ? lattice.cells[axis] : 0;
  d[next] = face.x;
  d[last] = face.y;
  const int odd = (d.x + d.y + d.z) & 1;
  const int up_next = which ^ odd, up_last = which;  // which corner of the face: (0, 0) or (1, 1), or (1, 0) or (0, 1)
  d[next] += up_next;
  d[last] += up_last;
  glm::ivec3 p = d, q = d;
  p[next] += up_next ? -1 : 1;
  q[last] += up_last ? -1 : 1;
  const bool outwards = (up_next == up_last) == high;
  const glm::i32vec3 at_d = lattice.vertex(d).deformed, at_p = lattice.vertex(p).deformed,
                     at_q = lattice.vertex(q).deformed;
  return outwards ? BorderTriangle{at_d, at_p, at_q} : BorderTriangle{at_d, at_q, at_p};
}

namespace detail {

/// Side of the edge from a to b, seen along x, on which the nudged row lies: the sign of the determinant of (b - a) and
/// (q - a) in y and z. On an exact tie q moves on by (sy e^2, sz e^3) for an infinitesimal e > 0.
template <class Int>
TETWARP_HD int side_of_edge(const glm::i32vec3& a, const glm::i32vec3& b, const glm::i32vec2& row,
                            const glm::i32vec3& signs) {
  const Int by = Int(b.y) - a.y, bz = Int(b.z) - a.z;
  const Int qy = (Int(row.x) - a.y) * kNudgeSteps + kNudgeY * signs.y;
  const Int qz = (Int(row.y) - a.z) * kNudgeSteps + kNudgeZ * signs.z;
  const Int value = by * qz - bz * qy;
  if (value != 0) return value > 0 ? 1 : -1;
  if (bz != 0) return (bz > 0) == (signs.y > 0) ? -1 : 1;
  return by == 0 ? 0 : ((by > 0) == (signs.z > 0) ? 1 : -1);
}

}  // namespace detail

/// Finds where the row of voxels (y, z) passes through a triangle.
///
/// @param nudge       nudge of the lattice
/// @param begin, end  half-open range of the voxels of the row that matter
/// @param first       set to the first voxel of the row beyond the triangle, clamped to `begin` and `end`
/// @return 1 where the row enters the lattice, -1 where it leaves it, 0 where it misses the triangle
template <class Int>
TETWARP_HD int cross_border(const BorderTriangle& t, const Nudge& nudge, int y, int z, int begin, int end, int& first) {
  const glm::i32vec3 signs(1, nudge.sign(1, y), nudge.sign(2, z));
  const glm::i32vec2 row(y * kStepsPerVoxel, z * kStepsPerVoxel);
  const int side = detail::side_of_edge<Int>(t.a, t.b, row, signs);
  if (side == 0 || detail::side_of_edge<Int>(t.b, t.c, row, signs) != side ||
      detail::side_of_edge<Int>(t.c, t.a, row, signs) != side) {
    return 0;
  }
  const glm::i32vec3 b = t.b - t.a, c = t.c - t.a;
  const Int nx = Int(b.y) * c.z - Int(b.z) * c.y, ny = Int(b.z) * c.x - Int(b.x) * c.z,
            nz = Int(b.x) * c.y - Int(b.y) * c.x;
  // Beyond: nx (q - a).x + rest has the sign of nx; q.x, with its nudge, grows from voxel to voxel.
  const Int rest = ny * ((Int(row.x) - t.a.y) * kNudgeSteps + kNudgeY * signs.y) +
                   nz * ((Int(row.y) - t.a.z) * kNudgeSteps + kNudgeZ * signs.z);
  const auto is_beyond = [&](int x) {
    const int sx = nudge.sign(0, x);
    const Int value = nx * ((Int(x) * kStepsPerVoxel - t.a.x) * kNudgeSteps + kNudgeX * sx) + rest;
    return value == 0 ? sx > 0 : (value > 0) == (nx > 0);
  };
  const double at =
      (t.a.x * double{kNudgeSteps} - to_double(rest) / to_double(nx)) * (1.0 / (kStepsPerVoxel * kNudgeSteps));
  first = at <= begin ? begin : (at >= end ? end : static_cast<int>(at));
  if (at < begin - 2.0 || at > end + 2.0) return -side;  // far off, products might not fit
  while (first > begin && is_beyond(first - 1)) --first;
  while (first < end && !is_beyond(first)) ++first;
  return -side;  // the side is the sign of nx: where the outer normal looks back along x, the row goes in
}

}  // namespace tetwarp
