// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/barycentric.h"
#include "deform/core/ownership.h"
#include "deform/core/region.h"

namespace tetwarp {

namespace detail {

TETWARP_HD inline std::int64_t floor_voxel(std::int32_t steps) { return steps >> 12; }

/// Voxels whose nudged centre can lie in [low, high] on one axis: closed on the side that the nudge points away from,
/// open on the other.
TETWARP_HD inline void candidates(const Nudge& nudge, int axis, std::int32_t low, std::int32_t high,
                                  std::int64_t* begin, std::int64_t* end) {
  std::int64_t first = floor_voxel(low), last = floor_voxel(high);
  if (first * kStepsPerVoxel != low || nudge.sign(axis, first) < 0) ++first;
  if (last * kStepsPerVoxel == high && nudge.sign(axis, last) > 0) --last;
  *begin = *begin > first ? *begin : first;
  *end = *end < last + 1 ? *end : last + 1;
}

/// The part of `region` that a tetrahedron or cell with this box may own.
TETWARP_HD inline Region candidates(const Nudge& nudge, const Box& box, Region region) {
  for (int axis = 0; axis < 3; ++axis) {
    candidates(nudge, axis, box.low[axis], box.high[axis], &region.begin[axis], &region.end[axis]);
  }
  return region;
}

TETWARP_HD inline glm::i32vec3 to_steps(const glm::i64vec3& voxel) {
  return {static_cast<std::int32_t>(voxel.x << 12), static_cast<std::int32_t>(voxel.y << 12),
          static_cast<std::int32_t>(voxel.z << 12)};
}

template <class Int>
TETWARP_HD Int floor_divide(Int a, Int b) {  // b > 0
  return a >= 0 ? a / b : -((b - 1 - a) / b);
}

/// Narrows [begin, end) of a row, in which the nudge is constant, to the voxels on the inner side of a face.
/// @param value  value of the face at offset 0 of the row, without the nudge
template <class Int>
TETWARP_HD void clip_row(const Face<Int>& face, Int value, const glm::i32vec3& signs, std::int64_t* begin,
                         std::int64_t* end) {
  bool tie_inside = false;  // does a voxel exactly on the face count as inside?
  for (int axis = 2; axis >= 0; --axis) {
    if (face.normal[axis] != 0) tie_inside = (face.normal[axis] < 0) == (signs[axis] > 0);
  }
  const Int least = tie_inside ? 0 : 1;  // inside: value - slope * offset >= least
  const Int slope = face.normal[0] * (Int(kStepsPerVoxel) * kNudgeSteps);
  if (slope == 0) {
    if (value < least) *end = *begin;
  } else if (slope > 0) {
    const Int last = floor_divide<Int>(value - least, slope);
    if (last < Int(*end) - 1) *end = static_cast<std::int64_t>(last) + 1;
  } else {
    const Int first = -floor_divide<Int>(value - least, -slope);
    if (first > Int(*begin)) *begin = static_cast<std::int64_t>(first);
  }
}

/// Makes the faces of a tetrahedron opposite A, B, C and D.
/// @param first  voxel from which the faces count, 2^-12 voxel
/// @return false for a tetrahedron without volume, which owns nothing
template <class Int>
TETWARP_HD bool make_faces(const Tetrahedron& t, const glm::i32vec3& first, Face<Int> (&faces)[4]) {
  const glm::i32vec3 a = t.a.deformed - first, b = t.b.deformed - first, c = t.c.deformed - first,
                     d = t.d.deformed - first;
  const Int volume = signed_volume(Relative<Int>(a), Relative<Int>(b), Relative<Int>(c), Relative<Int>(d));
  if (volume == 0) return false;
  const int orientation = volume > 0 ? -1 : 1;  // the determinants of `side_of_face` have the other sign
  faces[0] = make_face<Int>(b, c, d, orientation);
  faces[1] = make_face<Int>(a, d, c, orientation);
  faces[2] = make_face<Int>(a, b, d, orientation);
  faces[3] = make_face<Int>(a, c, b, orientation);
  return true;
}

/// Narrows [begin, end) of a row, in which the nudge is constant, to the voxels that a tetrahedron owns.
/// @param y, z  the row, in voxels from the voxel from which the faces count
template <class Int>
TETWARP_HD void clip_row(const Face<Int> (&faces)[4], std::int64_t y, std::int64_t z, const glm::i32vec3& signs,
                         std::int64_t* begin, std::int64_t* end) {
  const glm::i32vec3 nudged = nudge_steps(signs);
  for (const Face<Int>& face : faces) {
    const Int value = face.constant - face.normal[0] * nudged.x -
                      face.normal[1] * (Int(y) * (kStepsPerVoxel * kNudgeSteps) + nudged.y) -
                      face.normal[2] * (Int(z) * (kStepsPerVoxel * kNudgeSteps) + nudged.z);
    clip_row<Int>(face, value, signs, begin, end);
  }
}

/// Walks the rows of `box`: in each, the voxels of the tetrahedron are an interval between its faces.
template <class Int, class Visit>
TETWARP_HD void walk_rows(const Tetrahedron& t, int number, const Region& box, const Nudge& nudge, Visit& visit) {
  Face<Int> faces[4];
  if (!make_faces<Int>(t, to_steps(box.begin), faces)) return;
  for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
    for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
      std::int64_t x = box.begin.x;
      while (x < box.end.x) {  // twice where the middle, and so the nudge's sign, lies within the row
        const glm::i32vec3 signs = nudge.signs({x, y, z});
        std::int64_t begin = x - box.begin.x, end = box.end.x - box.begin.x;
        if (signs.x > 0 && nudge.sign(0, box.end.x - 1) < 0) {
          end = nudge.first_down(0) - box.begin.x;
        }
        x = box.begin.x + end;
        clip_row<Int>(faces, y - box.begin.y, z - box.begin.z, signs, &begin, &end);
        for (std::int64_t offset = begin; offset < end; ++offset) {
          visit(glm::i64vec3(box.begin.x + offset, y, z), signs, number, t);
        }
      }
    }
  }
}

/// Whether corner tetrahedron kNumber owns a voxel. Its face opposite D is also a face of the centre tetrahedron, with
/// corners in the same cyclic order, so `shared` has the side of that face.
template <class Int, bool kOdd, int kNumber>
TETWARP_HD bool corner_owns(const Relative<Int> (&at)[8], const int (&shared)[4], const VoxelNudge<Int>& nudge) {
  constexpr TetrahedronCorners kOf = tetrahedron_corners(kNumber, kOdd);
  const Relative<Int>&a = at[kOf.a], &b = at[kOf.b], &c = at[kOf.c], &d = at[kOf.d];
  const int side = shared[kOdd ? kNumber - 1 : 4 - kNumber];
  return side != 0 && side_of_face(b, c, d, nudge) == side && side_of_face(a, d, c, nudge) == side &&
         side_of_face(a, b, d, nudge) == side;
}

/// Tests all five tetrahedra of a cell against one voxel.
template <class Int, bool kOdd, class Visit>
TETWARP_HD void visit_voxel(const Cell& cell, const glm::i64vec3& voxel, const glm::i32vec3& signs, Visit& visit) {
  const glm::i32vec3 steps = to_steps(voxel);
  const VoxelNudge<Int> nudge(signs);
  Relative<Int> at[8];
  for (int corner = 0; corner < 8; ++corner) at[corner] = Relative<Int>(cell.corner[corner].deformed - steps);
  constexpr TetrahedronCorners kOf = tetrahedron_corners(0, kOdd);
  const Relative<Int>&a = at[kOf.a], &b = at[kOf.b], &c = at[kOf.c], &d = at[kOf.d];
  const int shared[4] = {side_of_face(b, c, d, nudge), side_of_face(a, d, c, nudge), side_of_face(a, b, d, nudge),
                         side_of_face(a, c, b, nudge)};
  if (shared[0] != 0 && shared[1] == shared[0] && shared[2] == shared[0] && shared[3] == shared[0]) {
    visit(voxel, signs, 0, tetrahedron_of(cell, 0, kOdd));
  }
  if (corner_owns<Int, kOdd, 1>(at, shared, nudge)) visit(voxel, signs, 1, tetrahedron_of(cell, 1, kOdd));
  if (corner_owns<Int, kOdd, 2>(at, shared, nudge)) visit(voxel, signs, 2, tetrahedron_of(cell, 2, kOdd));
  if (corner_owns<Int, kOdd, 3>(at, shared, nudge)) visit(voxel, signs, 3, tetrahedron_of(cell, 3, kOdd));
  if (corner_owns<Int, kOdd, 4>(at, shared, nudge)) visit(voxel, signs, 4, tetrahedron_of(cell, 4, kOdd));
}

/// Walks the voxels of a small box one by one.
template <class Int, class Visit>
TETWARP_HD void walk_voxels(const Cell& cell, bool odd, const Region& box, const Nudge& nudge, Visit& visit) {
  for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
    for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
      for (std::int64_t x = box.begin.x; x < box.end.x; ++x) {
        const glm::i64vec3 voxel(x, y, z);
        const glm::i32vec3 signs = nudge.signs(voxel);
        if (odd) {
          visit_voxel<Int, true>(cell, voxel, signs, visit);
        } else {
          visit_voxel<Int, false>(cell, voxel, signs, visit);
        }
      }
    }
  }
}

}  // namespace detail

/// Calls `visit(voxel, signs, t, tetrahedron)` for every voxel of `region` that tetrahedron t of the cell owns.
///
/// Every backend runs this body for one cell. Which voxels it reports is the definition of ownership
/// (docs/design/definition.md, "Who owns a voxel"); what becomes of them is up to the backend. A voxel in a fold is
/// reported by several tetrahedra, of this cell or of others: the one with the lowest number 5 * cell + t is its owner.
template <class Visit>
TETWARP_HD void visit_cell(const Cell& cell, bool odd, const Region& region, const Nudge& nudge, Visit&& visit) {
  constexpr std::int64_t kFewVoxels = 8;  // up to here, looking at each voxel beats setting up rows
  const Box cell_box = box_of(cell);
  const Region all = detail::candidates(nudge, cell_box, region);
  if (is_empty(all)) return;
  const glm::i64vec3 extent = all.end - all.begin;
  if (extent.x * extent.y * extent.z <= kFewVoxels) {
    if (fits_double(cell_box)) return detail::walk_voxels<double>(cell, odd, all, nudge, visit);
    if (fits_int64(cell_box)) return detail::walk_voxels<std::int64_t>(cell, odd, all, nudge, visit);
    return detail::walk_voxels<Wide>(cell, odd, all, nudge, visit);
  }
  for (int number = 0; number < kTetrahedraPerCell; ++number) {
    const Tetrahedron t = tetrahedron_of(cell, number, odd);
    const Box box = box_of(t);
    const Region voxels = detail::candidates(nudge, box, all);
    if (is_empty(voxels)) continue;
    if (fits_int64(box)) {
      detail::walk_rows<std::int64_t>(t, number, voxels, nudge, visit);
    } else {
      detail::walk_rows<Wide>(t, number, voxels, nudge, visit);
    }
  }
}

}  // namespace tetwarp
