// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/formula.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "deform/fields/sincos.h"

namespace tetwarp {

namespace {
constexpr double kTwoPi = 6.28318530717958647692;
}  // namespace

glm::dvec3 Wave::operator()(const glm::dvec3& point) const {
  glm::dvec3 displacement(0);
  displacement[axis] = amplitude * sin_cos(kTwoPi * ((point - centre)[along] / wavelength) + phase).sin;
  return displacement;
}

glm::dvec3 Twist::operator()(const glm::dvec3& point) const {
  const glm::dvec3 d = point - centre;
  const SinCos turn = sin_cos(angle * (d[axis] / half_length));
  const int from = (axis + 1) % 3, to = (axis + 2) % 3;
  glm::dvec3 displacement(0);
  displacement[from] = (d[from] * turn.cos - d[to] * turn.sin) - d[from];
  displacement[to] = (d[from] * turn.sin + d[to] * turn.cos) - d[to];
  return displacement;
}

glm::dvec3 Bubble::operator()(const glm::dvec3& point) const {
  const glm::dvec3 d = point - centre;
  const double r = std::sqrt(glm::dot(d, d));
  if (r >= radius) return glm::dvec3(0);
  const double rest = 1 - r / radius;
  return (strength * (rest * rest)) * d;
}

glm::dvec3 PaperBubble::operator()(const glm::dvec3& point) const {
  const glm::dvec3 d = point - centre;
  const double r = std::sqrt(glm::dot(d, d));
  return r == 0 ? glm::dvec3(0) : (shift / r) * d;
}

double half_length(const Geometry& volume, int axis) {
  const AffineMap point = point_from_index(volume);
  const glm::dvec3 middle = centre(volume);
  double longest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at =
        glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(volume.size - std::int64_t{1});
    longest = std::max(longest, std::abs(point(at)[axis] - middle[axis]));
  }
  return longest;
}

VertexField twist(const Geometry& volume, double angle, std::int64_t cell_size) {
  const Twist formula{.angle = angle, .half_length = half_length(volume, 2), .centre = centre(volume)};
  return sample_on(lattice_over(volume, cell_size), formula);
}

}  // namespace tetwarp
