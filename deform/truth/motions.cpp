// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/motions.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "deform/cpu/distance_map.h"
#include "deform/errors.h"
#include "deform/fields/elastic.h"
#include "deform/fields/point_map.h"
#include "deform/fields/sincos.h"
#include "deform/truth/levels.h"
#include "deform/truth/shapes.h"

namespace tetwarp::truth {

namespace {

constexpr double kPi = 3.14159265358979323846;

double value(const Values& values, std::string_view name) { return values.find(name)->second; }

/// A ball about the middle of what plays a role.
struct Ball {
  glm::dvec3 centre;
  double radius;  ///< mm: that of the farthest vertex, and half a cell
};

Ball ball_around(const Subject& subject, const std::string& role) {
  const std::vector<std::uint8_t> marked = subject.vertices(role);
  const std::vector<glm::dvec3> places = places_of(subject.lattice(), marked);
  Ball ball{glm::dvec3(0), 0};
  for (const glm::dvec3& place : places) ball.centre += place;
  ball.centre /= static_cast<double>(places.size());
  for (const glm::dvec3& place : places) ball.radius = std::max(ball.radius, glm::distance(place, ball.centre));
  const glm::dvec3 half = 0.5 * subject.lattice().spacing;
  ball.radius += std::max({half.x, half.y, half.z});
  return ball;
}

/// A field of radial shifts about a ball's centre: `to(r)` is where the distance r goes.
template <class To>
VertexField radial(const Subject& subject, const Ball& ball, To to, const Limits& limits, const Control& control) {
  return sample_on(
      subject.lattice(),
      [ball, to](const glm::dvec3& point) {
        const glm::dvec3 from = point - ball.centre;
        const double r = std::sqrt(glm::dot(from, from));
        return r == 0 ? glm::dvec3(0) : (to(r) / r - 1) * from;
      },
      limits, control);
}

}  // namespace

VertexField elastic_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control) {
  const Geometry& lattice = subject.lattice();
  const double amplitude = value(values, "amplitude");
  const Elastic elastic{amplitude, value(values, "spacing"), static_cast<std::uint64_t>(value(values, "seed")),
                        centre(lattice)};
  if (amplitude == 0)
    return sample_on(
        lattice, [](const glm::dvec3&) { return glm::dvec3(0); }, limits, control);
  // At 4 amplitudes from a face the fading adds at most 1.5 / 4 to the slope across it.
  const double fade = 4 * amplitude;
  const AffineMap index = index_from_point(lattice);
  const glm::dvec3 spacing = lattice.spacing, last(subject.last_inside());
  const glm::dmat3 direction = lattice.direction;
  return sample_on(
      lattice,
      [=](const glm::dvec3& point) {
        const glm::dvec3 at = index(point);
        glm::dvec3 along = glm::transpose(direction) * elastic(point);
        for (int axis = 0; axis < 3; ++axis) {
          const double from_face = spacing[axis] * std::min(at[axis], last[axis] - at[axis]);
          // Places on a face differ from it by rounding; their index is whole.
          along[axis] *= smooth_step(std::max(from_face - 1e-6 * spacing[axis], 0.0) / fade);
        }
        return direction * along;
      },
      limits, control);
}

VertexField shift_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control) {
  const glm::dvec3 by(value(values, "x"), value(values, "y"), value(values, "z"));
  return sample_on(
      subject.lattice(), [by](const glm::dvec3&) { return by; }, limits, control);
}

VertexField rotation_motion(const Subject& subject, const Values& values, const Limits& limits,
                            const Control& control) {
  const auto axis = static_cast<int>(value(values, "axis"));
  const SinCos turn = sin_cos(value(values, "angle") * kPi / 180);
  const glm::dvec3 middle = centre(subject.lattice());
  const int first = (axis + 1) % 3, second = (axis + 2) % 3;
  return sample_on(
      subject.lattice(),
      [=](const glm::dvec3& point) {
        const glm::dvec3 from = point - middle;
        glm::dvec3 by(0);
        by[first] = turn.cos * from[first] - turn.sin * from[second] - from[first];
        by[second] = turn.sin * from[first] + turn.cos * from[second] - from[second];
        return by;
      },
      limits, control);
}

VertexField breathing_motion(const Subject& subject, const Values& values, const Limits& limits,
                             const Control& control) {
  const double amplitude = value(values, "amplitude"), rise = value(values, "rise");
  const BreathingLevels levels(subject);
  const std::vector<double> from_held = distance_mm(subject.lattice(), levels.held(), limits);
  // The slope of what fades is at most 1.5 / 3 of the amplitude, so the belly and the diaphragm keep their sides.
  const double fade = std::max(3 * amplitude, 1.0);
  return on_vertices(subject.lattice(), limits, control, [&](std::size_t vertex, const glm::dvec3& point) {
    const double much = amplitude * levels.hill_at(point.z) * smooth_step(from_held[vertex] / fade);
    return glm::dvec3(0, -rise * much * levels.front_at(point.y), -much);
  });
}

VertexField filling_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control) {
  const Ball ball = ball_around(subject, "organ");
  const double ratio = value(values, "ratio"), scale = cube_root(ratio), radius = ball.radius;
  const double more = (ratio - 1) * radius * radius * radius;
  return radial(
      subject, ball,
      [=](double r) {
        if (r <= radius) return scale * r;
        const double by = cube_root(r * r * r + more) - r;
        return r + by * (1 - smooth_step((r / radius - 2.5) / 2.5));
      },
      limits, control);
}

VertexField shrinkage_motion(const Subject& subject, const Values& values, const Limits& limits,
                             const Control& control) {
  const Ball ball = ball_around(subject, "lump");
  const double scale = cube_root(value(values, "ratio")), radius = ball.radius;
  return radial(
      subject, ball,
      [=](double r) {
        if (r <= radius) return scale * r;
        return r + (scale - 1) * radius * (1 - smooth_step((r / radius - 1) / 2));
      },
      limits, control);
}

}  // namespace tetwarp::truth
