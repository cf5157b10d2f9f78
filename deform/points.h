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
  moved,   ///< a tetrahedron holds it and moved it, perhaps by nothing
  outside  ///< it lies outside the undeformed lattice or mesh, and stays where it is
};

/// Moves landmarks, or the vertices of a surface, by the forward map of a field. What the source shows at a point
/// before, the output volume shows where the point comes to lie.
///
/// Undeformed and deformed vertices are rounded to 2^-12 voxel of the output grid, as they are for volumes. A point is
/// moved, in double, by the affine map of the undeformed tetrahedron that holds it (one of five in a cell of a
/// lattice). A point up to 2^-12 voxel outside the lattice or mesh counts as inside. Of several tetrahedra that share a
/// face any may be taken, for their maps agree there; where tetrahedra of a mesh overlap undeformed, the one with the
/// lowest number is taken. Where the field folds, a point still goes to one place.
class PointMover {
 public:
  /// @param output   grid onto which volumes are resampled; it decides how vertices are rounded
  /// @param field    field in host memory, which must outlive this object
  /// @param limits   number of threads
  /// @param control  progress and stop
  /// @throws InputError for a field that `Resampler::set_field` refuses
  /// @throws Cancelled
  PointMover(const Geometry& output, const FieldView& field, const Limits& limits = {}, const Control& control = {});
  /// Frees the search structure. The field is not owned.
  ~PointMover();

  /// Moves one point; may be called from several threads at a time.
  /// @param point  LPS mm, moved in place. It keeps its bits where its tetrahedron does not move.
  /// @param determinant  if not null gets the determinant of the tetrahedron's map: its volume after over before; 1
  ///         for a point that no tetrahedron holds
  /// @return whether the field holds the point
  /// @throws InputError for a vertex near the point that is not finite
  PointStatus move(glm::dvec3& point, double* determinant = nullptr) const;
  /// Moves many points in parallel, each as the other overload does.
  /// @param points   LPS mm, moved in place
  /// @param control  progress and stop
  /// @return one status a point
  std::vector<PointStatus> move(std::span<glm::dvec3> points, const Control& control = {}) const;

  /// Private to the library: the undeformed tetrahedra, made ready for searching.
  class Map;

 private:
  Limits limits_;
  std::unique_ptr<const Map> map_;
};

/// Makes a `PointMover` and moves points with it once.
///
/// @param output   grid onto which volumes are resampled; it decides how vertices are rounded
/// @param field    field in host memory
/// @param points   LPS mm, moved in place. A point keeps its bits where its tetrahedron does not move.
/// @param limits   number of threads
/// @param control  progress and stop
/// @return one status a point
/// @throws InputError for a field that `Resampler::set_field` refuses, or a vertex near a point that is not finite
/// @throws Cancelled
std::vector<PointStatus> move_points(const Geometry& output, const FieldView& field, std::span<glm::dvec3> points,
                                     Limits limits = {}, const Control& control = {});

}  // namespace tetwarp
