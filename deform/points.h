// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "deform/resampler.h"

namespace tetwarp {

/// What became of a point.
enum class PointStatus : std::uint8_t {
  moved,   ///< by the tetrahedron that holds it; also where that rests
  outside  ///< of the undeformed lattice or mesh: it stays where it is
};

/// Moves landmarks or the vertices of a surface by the forward map of a field, as a resampler onto `output` sees it:
/// what the source shows at a point before, the output shows where the point comes to lie.
///
/// Rest and deformed vertices are snapped to 2^-12 voxel of `output` as for volumes (`snap_moved`). A point is moved by
/// the affine map of the undeformed tetrahedron that holds it (of a lattice, one of the five of a cell), in double. A
/// point on the border of the lattice or mesh, to within 2^-12 voxel, is inside. Which of several tetrahedra that share
/// a face is taken does not matter, for they agree there; where those of a mesh overlap undeformed, the lowest number
/// wins. Where the field folds, the forward map still has one value.
class PointMover {
 public:
  /// @param output  grid that volumes are resampled onto; it decides how vertices are snapped
  /// @param field   in host memory; must outlive this
  /// @throws InputError for a field that `Resampler::set_field` refuses; Cancelled
  PointMover(const Geometry& output, const FieldView& field, const Limits& limits = {}, const Control& control = {});
  ~PointMover();

  /// From any thread. @param point  LPS mm, moved in place; where its tetrahedron rests it keeps its bits
  /// @throws InputError for a vertex near it that is not finite
  PointStatus move(glm::dvec3& point) const;
  /// All of them, in parallel.
  std::vector<PointStatus> move(std::span<glm::dvec3> points, const Control& control = {}) const;

  class Map;

 private:
  Limits limits_;
  std::unique_ptr<const Map> map_;
};

/// `PointMover`, once.
///
/// @param output  grid that volumes are resampled onto; it decides how vertices are snapped
/// @param field   in host memory
/// @param points  LPS mm, moved in place; a point whose tetrahedron rests keeps its bits
/// @return one status a point
/// @throws InputError for a field that `Resampler::set_field` refuses, or a vertex near a point that is not finite;
/// Cancelled
std::vector<PointStatus> move_points(const Geometry& output, const FieldView& field, std::span<glm::dvec3> points,
                                     Limits limits = {}, const Control& control = {});

}  // namespace tetwarp
