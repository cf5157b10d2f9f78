// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/fixed_point.h"

namespace tetwarp {

/// A snapped lattice vertex: its deformed place, and u = undeformed minus deformed place, both in 2^-12 voxel of output
/// index.
struct Vertex {
  glm::i32vec3 deformed, u;
};

/// The eight corners of a cell; corner c lies at (c & 1, c >> 1 & 1, c >> 2) of it.
struct Cell {
  Vertex corner[8];
};

/// The corners A, B, C and the reference corner D of a tetrahedron (names of the paper).
struct Tetrahedron {
  Vertex a, b, c, d;
};

constexpr int kTetrahedraPerCell = 5;

/// Which corners of a cell its tetrahedron t has (docs/design/definition.md, "Five tetrahedra a cell").
///
/// Number 0 is the centre, {1, 2, 4, 7} in even cells (i + j + k even) and {0, 3, 5, 6} in odd ones; 1 to 4 are those
/// at the remaining corners in rising order. The parity must alternate: only then do the face diagonals of neighbouring
/// cells agree. D of a corner tetrahedron is its corner, and A, B, C lie from it along i, j, k. D of the centre is
/// corner 7 or 0, and A, B, C are across the faces i, j, k from it: so c ^ 6, c ^ 5, c ^ 3.
struct TetrahedronCorners {
  int a, b, c, d;
};
TETWARP_HD constexpr TetrahedronCorners tetrahedron_corners(int t, bool odd) {
  if (t == 0) {
    const int d = odd ? 0 : 7;
    return {d ^ 6, d ^ 5, d ^ 3, d};
  }
  const int d = (odd ? 0x7421 : 0x6530) >> (4 * (t - 1)) & 7;
  return {d ^ 1, d ^ 2, d ^ 4, d};
}

TETWARP_HD inline Tetrahedron tetrahedron_of(const Cell& cell, int t, bool odd) {
  const TetrahedronCorners corners = tetrahedron_corners(t, odd);
  return {cell.corner[corners.a], cell.corner[corners.b], cell.corner[corners.c], cell.corner[corners.d]};
}

/// A point relative to a voxel or vertex nearby, 2^-12 voxel. Int is any type that holds determinants of such points
/// exactly: double (`fits_double`), 64 bits (`fits_int64`) or Wide.
template <class Int>
struct Relative {
  Int x, y, z;

  Relative() = default;
  TETWARP_HD explicit Relative(const glm::i32vec3& steps)
      : x(static_cast<Int>(steps.x)), y(static_cast<Int>(steps.y)), z(static_cast<Int>(steps.z)) {}
};

/// Six times the signed volume of (A, B, C, D) about D, exact.
template <class Int>
TETWARP_HD Int signed_volume(const Relative<Int>& a, const Relative<Int>& b, const Relative<Int>& c,
                             const Relative<Int>& d) {
  const Int ax = a.x - d.x, ay = a.y - d.y, az = a.z - d.z;
  const Int bx = b.x - d.x, by = b.y - d.y, bz = b.z - d.z;
  const Int cx = c.x - d.x, cy = c.y - d.y, cz = c.z - d.z;
  return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
}

/// Jacobian determinant of the forward map of a tetrahedron: deformed over undeformed volume, both exact before the
/// division.
TETWARP_HD inline double jacobian(const Tetrahedron& t) {
  const auto volume = [](const glm::i32vec3& a, const glm::i32vec3& b, const glm::i32vec3& c, const glm::i32vec3& d) {
    return to_double(signed_volume(Relative<Wide>(a), Relative<Wide>(b), Relative<Wide>(c), Relative<Wide>(d)));
  };
  return volume(t.a.deformed, t.b.deformed, t.c.deformed, t.d.deformed) /
         volume(t.a.deformed + t.a.u, t.b.deformed + t.b.u, t.c.deformed + t.c.u, t.d.deformed + t.d.u);
}

/// Closed box around points, corners in 2^-12 voxel.
struct Box {
  glm::i32vec3 low, high;

  TETWARP_HD void grow(const glm::i32vec3& point) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = point[axis] < low[axis] ? point[axis] : low[axis];
      high[axis] = point[axis] > high[axis] ? point[axis] : high[axis];
    }
  }
};

TETWARP_HD inline Box box_of(const Tetrahedron& t) {
  Box box{t.a.deformed, t.a.deformed};
  box.grow(t.b.deformed);
  box.grow(t.c.deformed);
  box.grow(t.d.deformed);
  return box;
}

TETWARP_HD inline Box box_of(const Cell& cell) {
  Box box{cell.corner[0].deformed, cell.corner[0].deformed};
  for (int corner = 1; corner < 8; ++corner) box.grow(cell.corner[corner].deformed);
  return box;
}

/// Longest side of a box plus one voxel, in 2^-12 voxel.
TETWARP_HD inline std::int64_t reach_of(const Box& box) {
  std::int64_t longest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t side = std::int64_t{box.high[axis]} - box.low[axis] + kStepsPerVoxel;
    longest = side > longest ? side : longest;
  }
  return longest;
}

/// Whether determinants of points in the box, relative to one of its voxels and with the nudge, are exact in double:
/// with coordinates below 2^15 (8 voxels) they stay below 2^53.
TETWARP_HD inline bool fits_double(const Box& box) { return reach_of(box) <= std::int64_t{1} << 15; }

/// Whether determinants of points in the box, relative to one of its voxels and with the nudge, fit 64 bits: with
/// coordinates below 2^18 (64 voxels) they stay below 2^62.
TETWARP_HD inline bool fits_int64(const Box& box) { return reach_of(box) <= std::int64_t{1} << 18; }

}  // namespace tetwarp
