// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/simulate/cut.h"

namespace tetwarp::simulate {

/// Tells on which side of a cut a place lies, and whether the cut reaches that place.
class CutSurface {
 public:
  /// @throws InputError naming the cut: numbers that are not finite, a normal or sweep of length 0, a radius that is
  /// not above 0, a path of less than two points or that only goes along the sweep
  explicit CutSurface(const Cut& cut);

  /// Signed distance, mm, of a place (LPS mm) from the surface, or from the surface continued beyond its rim. It is a
  /// distance near the surface only; elsewhere it may jump.
  double side(const glm::dvec3& point) const;

  /// Whether the cut itself, not its continuation beyond the rim, passes near a place that `side` says is near the
  /// surface.
  bool reaches(const glm::dvec3& point) const;

 private:
  /// The place on the path that is nearest to a point, seen along the sweep.
  struct Nearest {
    double side;    ///< signed distance from the point, mm
    bool is_on_it;  ///< whether the nearest place is not an end that the point lies beyond
    double height;  ///< mm along the sweep, of that place
  };
  Nearest nearest_on_path(const glm::dvec3& point) const;

  std::variant<PlaneCut, DiscCut, SweptCut> shape_;
  glm::dvec3 up_{0};                ///< unit vector: the normal of a plane, or the direction of the sweep
  std::vector<glm::dvec3> flat_;    ///< the path's points seen along the sweep: their parts across it, mm
  std::vector<double> heights_;     ///< the path's points: their parts along the sweep, mm
  std::vector<glm::dvec3> across_;  ///< by piece of the path: the unit vector across it and the sweep
};

}  // namespace tetwarp::simulate
