// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <variant>
#include <vector>

#include "deform/geometry.h"

namespace tetwarp::simulate {

/// Through the whole lattice.
struct PlaneCut {
  glm::dvec3 point, normal;  ///< LPS mm; any length
};
struct DiscCut {
  glm::dvec3 centre, normal;  ///< LPS mm; any length
  double radius_mm;
};
/// What a blade leaves that goes along a line of points: the surface from the line to the line moved by `sweep`.
struct SweptCut {
  std::vector<glm::dvec3> path;  ///< LPS mm, two points or more
  glm::dvec3 sweep;              ///< LPS mm, how deep and where to
  bool is_closed = false;        ///< the last point is joined with the first: a tube
};

/// A surface along which links are severed.
struct Cut {
  std::string name;
  std::variant<PlaneCut, DiscCut, SweptCut> shape;
};

}  // namespace tetwarp::simulate
