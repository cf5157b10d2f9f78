// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "deform/simulate/patient.h"

namespace tetwarp::simulate {

/// What numbers of a scenario are measured by: mm, or the box of the patient's body, so that they carry over to others.
enum class Unit : std::uint8_t { mm, body };

/// A point: LPS mm, or parts of the body's box along L, P, S (0 is its right, front and lower side).
struct Place {
  glm::dvec3 at{0};
  Unit unit = Unit::mm;
};
/// A radius or depth: mm, or parts of the longest side of the body's box.
struct Length {
  double value = 0;
  Unit unit = Unit::mm;
};
/// A displacement: LPS mm, or parts of the sides of the body's box along L, P, S.
struct Shift {
  glm::dvec3 by{0};
  Unit unit = Unit::mm;
};

/// @throws InputError for parts of a body where the patient has none
glm::dvec3 point_of(const Place& place, const Patient& patient);
double mm_of(const Length& length, const Patient& patient);
glm::dvec3 mm_of(const Shift& shift, const Patient& patient);

struct Sphere {
  Place at;
  Length radius;
};
/// Sides along L, P, S; in whichever order the corners are.
struct Box {
  Place from, to;
};
/// The side of a plane that its normal points to, and the plane.
struct HalfSpace {
  Place at;
  glm::dvec3 normal;  ///< LPS, any length
};
/// From `low` up to but not `high`.
struct HuRange {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();

  bool contains(double hu) const { return hu >= low && hu < high; }
};
struct Labels {
  std::vector<std::int64_t> values;
};
/// Vertices without neighbours on some side.
struct Border {};
/// Vertices of the body's cells.
struct Body {};

struct Zone;
struct AllOf {
  std::vector<Zone> parts;
};
struct AnyOf {
  std::vector<Zone> parts;
};
struct Not {
  std::vector<Zone> part;  ///< one
};

/// Some vertices of a lattice: what a scenario calls a region.
struct Zone {
  std::variant<Sphere, Box, HalfSpace, HuRange, Labels, Border, Body, AllOf, AnyOf, Not> shape;
};

/// For each vertex of the patient's lattice, i fastest, whether it is in the zone.
/// @throws InputError for a label without label volume, or parts of a body where there is none
std::vector<std::uint8_t> select(const Zone& zone, const Patient& patient);

/// Vertices not further than `radius_mm` from a point; where there is none, the nearest vertex (of several, the first).
/// @throws InputError where that is further away than a cell is wide from corner to corner: the place is not in the
/// lattice
std::vector<std::size_t> grasp(const glm::dvec3& point, double radius_mm, const Patient& patient);

}  // namespace tetwarp::simulate
