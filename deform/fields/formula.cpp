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

/// Sine and cosine of angles one after the other, of which many are the same as the last.
class Angles {
 public:
  SinCos operator()(double angle) {
    if (angle != last_ || angle == 0) {  // -0 equals 0 but has another sine
      last_ = angle;
      of_last_ = sin_cos(angle);
    }
    return of_last_;
  }

 private:
  double last_ = 0;
  SinCos of_last_{};
};

glm::dvec3 displacement_of(const Wave& wave, const glm::dvec3& point, Angles& angles) {
  const double angle = kTwoPi * ((point[wave.along] - wave.centre[wave.along]) / wave.wavelength) + wave.phase;
  glm::dvec3 displacement(0);
  displacement[wave.axis] = wave.amplitude * angles(angle).sin;
  return displacement;
}

glm::dvec3 displacement_of(const Twist& twist, const glm::dvec3& point, Angles& angles) {
  const glm::dvec3 d = point - twist.centre;
  const SinCos turn = angles(twist.angle * (d[twist.axis] / twist.half_length));
  const int from = (twist.axis + 1) % 3, to = (twist.axis + 2) % 3;
  glm::dvec3 displacement(0);
  displacement[from] = (d[from] * turn.cos - d[to] * turn.sin) - d[from];
  displacement[to] = (d[from] * turn.sin + d[to] * turn.cos) - d[to];
  return displacement;
}

template <class Formula>
glm::dvec3 displacement_of(const Formula& formula, const glm::dvec3& point) {
  Angles angles;
  return displacement_of(formula, point, angles);
}

template <class Formula>
void displacements_of(const Formula& formula, std::span<const glm::dvec3> points, glm::dvec3* displacement) {
  Angles angles;
  for (std::size_t n = 0; n < points.size(); ++n) displacement[n] = displacement_of(formula, points[n], angles);
}

}  // namespace

glm::dvec3 Wave::operator()(const glm::dvec3& point) const { return displacement_of(*this, point); }
void Wave::of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const {
  displacements_of(*this, points, displacement);
}

glm::dvec3 Twist::operator()(const glm::dvec3& point) const { return displacement_of(*this, point); }
void Twist::of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const {
  displacements_of(*this, points, displacement);
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
