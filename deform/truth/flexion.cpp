// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include "deform/cpu/distance_map.h"
#include "deform/errors.h"
#include "deform/fields/sincos.h"
#include "deform/truth/levels.h"
#include "deform/truth/motions.h"

namespace tetwarp::truth {

namespace {

constexpr double kPi = 3.14159265358979323846;

/// A bent beam: its straight middle line runs along z at depth `y`, its angle to z grows evenly from `low` to `high`.
struct Beam {
  double y, low, high, angle;

  double angle_at(double z) const { return angle * std::clamp((z - low) / (high - low), 0.0, 1.0); }
  /// Where the point (y, z) of the middle line goes: the integral of (-sin, cos) of the angle.
  glm::dvec2 line_at(double z) const {
    const double bent = std::clamp(z, low, high) - low, curvature = angle / (high - low);
    const SinCos at = sin_cos(angle_at(z));
    glm::dvec2 place(y, low);
    if (angle == 0) return {y, z};
    place += glm::dvec2(at.cos - 1, at.sin) / curvature;
    const double straight = z - low - bent;
    return place + straight * glm::dvec2(-at.sin, at.cos);
  }
  /// The rigid motion of the line's frame at `z`, applied to a point.
  glm::dvec3 moved_with(double z, const glm::dvec3& point) const {
    const SinCos at = sin_cos(angle_at(z));
    const glm::dvec2 place = line_at(z), from(point.y - y, point.z - z);
    return {point.x, place.x + at.cos * from.x - at.sin * from.y, place.y + at.sin * from.x + at.cos * from.y};
  }
};

/// A bone that moves rigidly.
struct Bone {
  double z = 0;                  ///< LPS mm of its middle
  std::vector<double> distance;  ///< of each vertex from it, mm
};

}  // namespace

VertexField flexion_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control) {
  const Geometry& lattice = subject.lattice();
  const std::vector<glm::dvec3> all = places_of(lattice, subject.vertices("bone"));
  glm::dvec3 middle(0), low(all.front()), high(low);
  for (const glm::dvec3& place : all) {
    middle += place / static_cast<double>(all.size());
    low = glm::min(low, place);
    high = glm::max(high, place);
  }
  require(high.z > low.z, "the bones are flat; flexion needs some above others");
  const Beam beam{middle.y, low.z, high.z, values.find("angle")->second * kPi / 180};

  std::vector<Bone> bones;
  for (const std::int64_t label : subject.labels("bone")) {
    std::vector<std::uint8_t> marked;
    for (const std::int64_t one : subject.patient().vertex_label) marked.push_back(one == label);
    const std::vector<glm::dvec3> places = places_of(lattice, marked);
    if (places.empty()) continue;
    Bone bone;
    for (const glm::dvec3& place : places) bone.z += place.z / static_cast<double>(places.size());
    bone.distance = distance_mm(lattice, marked, limits);
    bones.push_back(std::move(bone));
  }
  // Far from all bones the bending alone counts: it weighs as much as a bone at this distance.
  constexpr double kFarMm = 25;
  // All corners of a cell that holds a part of a bone move with it.
  const double cell = 1.01 * std::sqrt(glm::dot(lattice.spacing, lattice.spacing));
  return on_vertices(lattice, limits, control, [&](std::size_t vertex, const glm::dvec3& point) {
    const Bone& nearest = *std::min_element(bones.begin(), bones.end(), [&](const Bone& a, const Bone& b) {
      return a.distance[vertex] < b.distance[vertex];
    });
    if (nearest.distance[vertex] <= cell) return beam.moved_with(nearest.z, point) - point;
    double weight = 1 / (kFarMm * kFarMm);
    glm::dvec3 sum = weight * beam.moved_with(point.z, point);
    for (const Bone& bone : bones) {
      const double distance = bone.distance[vertex] - cell;
      weight += 1 / (distance * distance);
      sum += beam.moved_with(bone.z, point) / (distance * distance);
    }
    return sum / weight - point;
  });
}

}  // namespace tetwarp::truth
