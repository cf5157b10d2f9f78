// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/phantom/shapes.h"

#include "deform/fields/sincos.h"

namespace tetwarp::phantom {

namespace {

/// Half the size of the box along the axes that holds a turned box.
Point turned_half_size(const glm::mat3& axes, Point half_size) {
  Point sum(0);
  for (int axis = 0; axis < 3; ++axis) sum += glm::abs(axes[axis]) * half_size[axis];
  return sum;
}

}  // namespace

glm::mat3 rotation(Point degrees) {
  constexpr double kRadians = 3.14159265358979323846 / 180;
  const SinCos x = sin_cos(degrees.x * kRadians), y = sin_cos(degrees.y * kRadians), z = sin_cos(degrees.z * kRadians);
  const glm::dmat3 about_x(1, 0, 0, 0, x.cos, x.sin, 0, -x.sin, x.cos);
  const glm::dmat3 about_y(y.cos, 0, -y.sin, 0, 1, 0, y.sin, 0, y.cos);
  const glm::dmat3 about_z(z.cos, z.sin, 0, -z.sin, z.cos, 0, 0, 0, 1);
  return glm::mat3(about_z * about_y * about_x);
}

Bounds Ellipsoid::bounds() const {
  const Point half = turned_half_size(axes, semi_axes);
  return {centre - half, centre + half};
}

Bounds RoundedBox::bounds() const {
  const Point half = turned_half_size(axes, half_size);
  return {centre - half, centre + half};
}

Bounds Rod::bounds() const { return {glm::min(a - radius_a, b - radius_b), glm::max(a + radius_a, b + radius_b)}; }

}  // namespace tetwarp::phantom
