// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/barycentric.h"
#include "deform/geometry.h"

namespace tetwarp {

/// Largest displacement of a vertex on an axis, voxels of the output grid.
constexpr double kFarthest = 1 << 17;

/// Whether every component is smaller than `limit` in size; false for NaN.
TETWARP_HD inline bool is_within(const glm::dvec3& index, double limit) {
  return std::fabs(index.x) < limit && std::fabs(index.y) < limit && std::fabs(index.z) < limit;
}

/// Snaps the undeformed and the deformed place of a vertex. u is zero exactly where the displacement is.
/// @param rest            undeformed place, continuous output index, within kLargestIndex
/// @param output_from_mm  linear map from LPS mm to output index
/// @param displacement    LPS mm
/// @param vertex          the result
/// @return false where the displacement is not finite or too long
TETWARP_HD inline bool snap_moved(const glm::dvec3& rest, const glm::dmat3& output_from_mm,
                                  const glm::vec3& displacement, Vertex& vertex) {
  const glm::i32vec3 snapped = snap(rest);
  vertex = {snapped, glm::i32vec3(0)};
  if (displacement.x == 0 && displacement.y == 0 && displacement.z == 0) return true;
  const glm::dvec3 shift = output_from_mm * glm::dvec3(displacement);
  if (!is_within(shift, kFarthest) || !is_within(rest + shift, kLargestIndex)) return false;
  vertex.deformed = snap(rest + shift);
  vertex.u = snapped - vertex.deformed;
  return true;
}

/// Length, in voxels of the output, from which on the steps of a lattice make its field a coarse one.
constexpr double kCoarseStep = 2.5;
/// How far, in voxels, the undeformed place of a voxel may lie outside its undeformed owner where the field is coarse:
/// the owner holds the nudged voxel, and a place changes by less than 129 times the nudge.
constexpr double kBeyondCoarse = 1.0 / 16;

/// How a lattice lies over an output grid: the maps that turn its vertices into snapped ones.
struct LatticeFrame {
  AffineMap output_from_lattice, lattice_from_output;
  glm::dmat3 output_from_mm{1};
  glm::i64vec3 cells{0};
  /// For a part of a lattice: number of slices along k that come before it in the whole lattice. Its vertices count
  /// from there; maps and nudge are those of the whole lattice. It is even, so that cells keep their parity.
  std::int64_t first_slice = 0;
  Nudge nudge;
  /// Whether the lattice is coarse: each of its steps is at least `kCoarseStep` voxels of the whole output long
  /// (docs/design/definition.md, "Coarse fields").
  bool coarse = false;

  /// Computes both places of a vertex in double, in output index, and snaps them. u is zero exactly where the
  /// displacement is.
  /// @return false where the displacement is not finite or too long
  TETWARP_HD bool snap_vertex(const glm::i64vec3& at, const glm::vec3& displacement, Vertex& vertex) const {
    const glm::dvec3 rest = output_from_lattice(glm::dvec3(at.x, at.y, at.z + first_slice));
    return snap_moved(rest, output_from_mm, displacement, vertex);
  }

  /// How far, in output index, an undeformed place may lie outside the undeformed box of its cell, because weights may
  /// leave [0, 1] by kWeightSlack.
  glm::dvec3 beyond_rest() const {
    const glm::dmat3& m = output_from_lattice.linear;
    glm::dvec3 reach(0);
    for (int axis = 0; axis < 3; ++axis) {
      for (int row = 0; row < 3; ++row) reach[row] += 4 * kWeightSlack * std::fabs(m[axis][row]);
    }
    return coarse ? reach + kBeyondCoarse : reach;
  }

  /// Whether the nudged voxel lies inside the undeformed lattice, which must be a whole one.
  TETWARP_HD bool holds(const glm::i64vec3& voxel) const {
    const glm::dvec3 step = glm::dvec3(nudge_steps(nudge.signs(voxel))) * (1.0 / (kStepsPerVoxel * kNudgeSteps));
    const glm::dvec3 at = lattice_from_output(glm::dvec3(voxel) + step);
    return at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x <= static_cast<double>(cells.x) &&
           at.y <= static_cast<double>(cells.y) && at.z <= static_cast<double>(cells.z);
  }
};

}  // namespace tetwarp
