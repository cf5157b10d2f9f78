// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/five_tetrahedra.h"

namespace tetwarp {

/// The nudge of one voxel: its signs (+1 or -1 on each axis), and the shift d in units of 2^-16 voxel.
template <class Int>
struct VoxelNudge {
  glm::i32vec3 signs;
  Relative<Int> d;

  TETWARP_HD explicit VoxelNudge(const glm::i32vec3& s) : signs(s), d(nudge_steps(s)) {}
};

/// Side of the face (a, b, c) on which the nudged voxel lies: +1 or -1; 0 only for a face without area.
///
/// The sign of det(a - q, b - q, c - q) = (a - q) . N with N = (b - a) x (c - a), q = p + d; on an exact tie the first
/// non-zero of -sx Nx, -sy Ny, -sz Nz, which is what an infinitesimal step from q towards the middle gives.
///
/// A tetrahedron (A, B, C, D) owns the voxel when its faces BCD, ADC, ABD, ACB agree (docs/design/definition.md, "Who
/// owns a voxel"). Inverted ones own like any other, and one without volume never does, for its four determinants sum
/// to zero. Two tetrahedra that share a face call this with the same corners, and the order of the corners flips the
/// sign exactly.
template <class Int>
TETWARP_HD inline int side_of_face(const Relative<Int>& a, const Relative<Int>& b, const Relative<Int>& c,
                                   const VoxelNudge<Int>& nudge) {
  const Int ux = b.x - a.x, uy = b.y - a.y, uz = b.z - a.z;
  const Int vx = c.x - a.x, vy = c.y - a.y, vz = c.z - a.z;
  const Int nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
  const Int e = (a.x * kNudgeSteps - nudge.d.x) * nx + (a.y * kNudgeSteps - nudge.d.y) * ny +
                (a.z * kNudgeSteps - nudge.d.z) * nz;
  if (e != 0) return e > 0 ? 1 : -1;
  if (nx != 0) return (nx > 0) == (nudge.signs.x > 0) ? -1 : 1;
  if (ny != 0) return (ny > 0) == (nudge.signs.y > 0) ? -1 : 1;
  if (nz != 0) return (nz > 0) == (nudge.signs.z > 0) ? -1 : 1;
  return 0;
}

/// A face of a tetrahedron as a function of the voxel, for walking many voxels: its normal, twice as long as its area,
/// and a constant.
///
/// value(p) = constant - 2^16 (p - first) . normal - d . normal, in units of 2^-40 voxel^3, is positive on the inner
/// side.
template <class Int>
struct Face {
  Int normal[3], constant;
};

/// Makes the face (a, b, c).
/// @param a, b, c      corners relative to the first voxel, 2^-12 voxel
/// @param orientation  +1 or -1, so that the value is positive inside
template <class Int>
TETWARP_HD Face<Int> make_face(const glm::i32vec3& a, const glm::i32vec3& b, const glm::i32vec3& c, int orientation) {
  const Int ux = b.x - a.x, uy = b.y - a.y, uz = b.z - a.z;  // in 32 bits, so that products are cheap
  const Int vx = c.x - a.x, vy = c.y - a.y, vz = c.z - a.z;
  Face<Int> face;
  face.normal[0] = (uy * vz - uz * vy) * orientation;
  face.normal[1] = (uz * vx - ux * vz) * orientation;
  face.normal[2] = (ux * vy - uy * vx) * orientation;
  face.constant = (Int(a.x) * face.normal[0] + Int(a.y) * face.normal[1] + Int(a.z) * face.normal[2]) * kNudgeSteps;
  return face;
}

}  // namespace tetwarp
