// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <variant>
#include <vector>

#include "deform/geometry.h"

namespace tetwarp::simulate {

/// A cut along a plane, through the whole lattice.
struct PlaneCut {
  glm::dvec3 point,  ///< a point of the plane, LPS mm
      normal;        ///< LPS, of any length
};
/// A cut along a flat disc.
struct DiscCut {
  glm::dvec3 centre,  ///< LPS mm
      normal;         ///< LPS, of any length
  double radius_mm;   ///< radius, mm
};
/// The cut of a blade that follows a line of points: the surface between that line and the line moved by `sweep`.
struct SweptCut {
  std::vector<glm::dvec3> path;  ///< at least two points, LPS mm
  glm::dvec3 sweep;              ///< direction and depth of the cut, LPS mm
  bool is_closed = false;        ///< whether the last point is joined to the first, so that the cut is a tube
};

/// A surface along which links are severed.
struct Cut {
  std::string name;  ///< name that scenarios and messages use
  /// The surface.
  std::variant<PlaneCut, DiscCut, SweptCut> shape;
};

}  // namespace tetwarp::simulate
