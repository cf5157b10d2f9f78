// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "deform/simulate/model.h"
#include "deform/simulate/spring_step.h"

namespace tetwarp::simulate {

/// Where the vertices of a lattice rest, in LPS mm from its middle: squares of such numbers lose nothing, however far
/// away the origin is.
struct RestPlace {
  std::uint32_t width, height;  ///< vertices along i, j
  glm::dvec3 middle;            ///< index of the middle of the lattice
  glm::dmat3 linear;            ///< columns: the steps from a vertex to the next along i, j, k, LPS mm

  explicit RestPlace(const Geometry& lattice);
  RestPlace() = default;
  /// The place of a vertex. @param vertex  its number, i fastest
  TETWARP_HD glm::dvec3 operator()(std::uint32_t vertex) const {
    const std::uint32_t row = vertex / width;
    return linear * (glm::dvec3{double(vertex % width), double(row % height), double(row / height)} - middle);
  }
};

/// Sums over placed nodes of where a node is (`at`, mm) and how far it has to go from there (`way`, mm).
struct Ways {
  double count = 0,                               ///< number of nodes
      squares = 0;                                ///< sum of the squared lengths of ways, mm^2
  glm::dvec3 at{0}, way{0};                       ///< sums of `at` and `way`
  Symmetric<double> at_at{0, 0, 0, 0, 0, 0};      ///< sum of at at^T
  glm::dvec3 at_by_x{0}, at_by_y{0}, at_by_z{0};  ///< for each component of `way`, the sum of it times `at`

  /// The sums over one node.
  TETWARP_HD static Ways of(const glm::dvec3& at, const glm::dvec3& way) {
    Ways one;
    one.count = 1;
    one.squares = dot3(way, way);
    one.at = at;
    one.way = way;
    one.at_at = {at.x * at.x, at.x * at.y, at.x * at.z, at.y * at.y, at.y * at.z, at.z * at.z};
    one.at_by_x = way.x * at, one.at_by_y = way.y * at, one.at_by_z = way.z * at;
    return one;
  }
  TETWARP_HD void add(const Ways& other) {
    count += other.count;
    squares += other.squares;
    at += other.at;
    way += other.way;
    at_at = at_at + other.at_at;
    at_by_x += other.at_by_x, at_by_y += other.at_by_y, at_by_z += other.at_by_z;
  }
};

/// x -> x + turned (x - about) + way, where I + turned is a rotation.
struct RigidMotion {
  glm::dmat3 turned{0};
  glm::dvec3 about{0}, way{0};

  /// How far the motion takes a point, mm.
  TETWARP_HD glm::dvec3 way_of(const glm::dvec3& at) const { return turned * (at - about) + way; }
};

/// The rigid motion that is closest to given ways. Mass-spring first moves free nodes by it when placed nodes move, so
/// that springs have less left to do.
///
/// Closest means by the sum of squares (W. Kabsch 1976, "A solution for the best rotation to relate two sets of
/// vectors", by singular values): the rotation R with the largest trace of R^T H, where H is the sum of (at + way) at^T
/// about the means.
///
/// Points on a line, or a single point, leave rotations open. Of these the smallest is taken: 1e-8 of the spread of the
/// points is added to H as if it lay in all directions and did not move.
///
/// @return nothing unless the squares of what the motion leaves over are less than a quarter of the squares of the ways
std::optional<RigidMotion> rigid_motion(const Ways& ways);

}  // namespace tetwarp::simulate
