// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "deform/simulate/patient.h"

namespace tetwarp::simulate {

/// Unit of a length or place in a scenario.
enum class Unit : std::uint8_t {
  mm,   ///< millimetres
  body  ///< parts of the box of the patient's body, so that a scenario fits other patients
};

/// A point: LPS mm, or parts of the body's box along L, P, S, where 0 is the right, front and lower side.
struct ScenarioPoint {
  glm::dvec3 at{0};      ///< coordinates
  Unit unit = Unit::mm;  ///< their unit
};
/// A radius or depth: mm, or parts of the longest side of the body's box.
struct Length {
  double value = 0;      ///< the number
  Unit unit = Unit::mm;  ///< its unit
};
/// A displacement: LPS mm, or parts of the sides of the body's box along L, P, S.
struct Shift {
  glm::dvec3 by{0};      ///< components
  Unit unit = Unit::mm;  ///< their unit
};

/// A place in LPS mm.
/// @throws InputError for parts of the body where the patient has no body
glm::dvec3 point_of(const ScenarioPoint& place, const Patient& patient);
/// A length in mm.
/// @throws InputError for parts of the body where the patient has no body
double mm_of(const Length& length, const Patient& patient);
/// A displacement in LPS mm.
/// @throws InputError for parts of the body where the patient has no body
glm::dvec3 mm_of(const Shift& shift, const Patient& patient);

/// A direction of any length as scenario files have it: its largest component is 1 in size.
inline glm::dvec3 scaled_direction(const glm::dvec3& v) {
  const glm::dvec3 size = glm::abs(v);
  return v / std::max(size.x, std::max(size.y, size.z));
}

/// A ball.
struct Sphere {
  ScenarioPoint at;  ///< its centre
  Length radius;     ///< its radius
};
/// A box with sides along L, P, S.
struct AlignedBox {
  ScenarioPoint from,  ///< a corner
      to;              ///< the opposite corner; either may be the lower one
};
/// A plane, and the side to which its normal points.
struct HalfSpace {
  ScenarioPoint at;   ///< a place on the plane
  glm::dvec3 normal;  ///< in LPS, of any length
};
/// HU from `low` up to, but not including, `high`.
struct HuRange {
  double low = -std::numeric_limits<double>::infinity(),  ///< in HU; included
      high = std::numeric_limits<double>::infinity();     ///< in HU; not included

  /// Whether a value lies in the range.
  bool contains(double hu) const { return hu >= low && hu < high; }
};
/// Vertices with one of these labels.
struct Labels {
  std::vector<std::int64_t> values;  ///< the labels
};
/// Vertices that lack a neighbour on some side of the lattice.
struct Border {};
/// Vertices of the cells of the body.
struct Body {};

struct Zone;
/// Vertices that lie in all parts.
struct AllOf {
  std::vector<Zone> parts;  ///< the zones
};
/// Vertices that lie in at least one part.
struct AnyOf {
  std::vector<Zone> parts;  ///< the zones
};
/// Vertices that do not lie in the part.
struct Not {
  std::vector<Zone> part;  ///< one zone
};

/// A set of vertices of a lattice. Scenario files call it a region.
struct Zone {
  /// How the set is described.
  std::variant<Sphere, AlignedBox, HalfSpace, HuRange, Labels, Border, Body, AllOf, AnyOf, Not> shape;
};

/// For each vertex of the patient's lattice, i fastest: 1 if it lies in the zone, else 0.
/// @throws InputError for labels where the patient has no label volume, or parts of the body where it has no body
std::vector<std::uint8_t> select(const Zone& zone, const Patient& patient);

/// Numbers of the vertices up to `radius_mm` from a point (LPS mm). If there are none, the nearest vertex; of several,
/// the first.
/// @throws InputError if the nearest vertex is further away than the diagonal of a cell, because the point lies outside
///         the lattice
std::vector<std::size_t> grasp(const glm::dvec3& point, double radius_mm, const Patient& patient);

}  // namespace tetwarp::simulate
