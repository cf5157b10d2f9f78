// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <variant>

#include "deform/core/host_device.h"

namespace tetwarp::phantom {

/// Solid shapes are given by their signed distance in mm: negative inside, approximate away from the surface, which is
/// all that blending at edges needs. They use float and only + - * / and square root, so they have the same bits on
/// every machine.
///
/// Points are in body space: LPS mm of a field of view of 410 x 410 x 300 mm with its middle at the origin.
using Point = glm::vec3;

struct Bounds {
  Point low, high;
};

/// A rotation by angles in degrees about x, then y, then z. Its columns are the shape's own axes in body space.
glm::mat3 rotation(Point degrees);

struct Ellipsoid {
  Point centre, semi_axes;
  glm::mat3 axes{1};

  float distance(Point p) const {
    const Point local = glm::transpose(axes) * (p - centre), q = local / semi_axes, g = q / semi_axes;
    const float k = std::sqrt(glm::dot(q, q)), slope = std::sqrt(glm::dot(g, g)) + 1e-9f;
    return k * (k - 1) / slope;
  }
  Bounds bounds() const;
  float thickness() const { return 2 * std::min({semi_axes.x, semi_axes.y, semi_axes.z}); }
};

/// A box with round edges.
struct RoundedBox {
  Point centre, half_size;
  glm::mat3 axes{1};
  float rounding = 1;

  float distance(Point p) const {
    const Point q = glm::abs(glm::transpose(axes) * (p - centre)) - half_size + rounding;
    const Point out = glm::max(q, 0.0f);
    return std::sqrt(glm::dot(out, out)) + std::min(std::max({q.x, q.y, q.z}), 0.0f) - rounding;
  }
  Bounds bounds() const;
  float thickness() const { return 2 * std::min({half_size.x, half_size.y, half_size.z}); }
};

/// A rod from `a` to `b` with round ends, whose radius goes from `radius_a` to `radius_b`: vessels, bony processes,
/// bowel.
struct Rod {
  Point a, b;
  float radius_a = 1, radius_b = 1;

  float distance(Point p) const {
    const Point ab = b - a, ap = p - a;
    const float t = std::clamp(glm::dot(ap, ab) / (glm::dot(ab, ab) + 1e-9f), 0.0f, 1.0f);
    const Point off = ap - t * ab;
    return std::sqrt(glm::dot(off, off)) - (radius_a + t * (radius_b - radius_a));
  }
  Bounds bounds() const;
  float thickness() const { return 2 * std::min(radius_a, radius_b); }
};

/// The body of a vertebra, or a disc: an elliptic cylinder along z with a waist.
struct Puck {
  Point centre, half_size;
  float waist = 0.1f;    ///< part of the half size by which the middle is thinner
  float hollow = 0.16f;  ///< part of half_size.z by which the ends are hollow

  float distance(Point p) const {
    const Point q = p - centre;
    const float h = std::min(q.z * q.z / (half_size.z * half_size.z), 1.0f), widen = 1 - waist * (1 - h);
    const float u = q.x / (widen * half_size.x), v = q.y / (widen * half_size.y);
    const float side = (std::sqrt(u * u + v * v) - 1) * std::min(half_size.x, half_size.y);
    return std::max(side, std::abs(q.z) - half_size.z * (1 - hollow * (1 - std::min(u * u + v * v, 1.0f))));
  }
  Bounds bounds() const { return {centre - half_size, centre + half_size}; }
  float thickness() const { return 2 * half_size.z; }
};

using Shape = std::variant<Ellipsoid, RoundedBox, Rod, Puck>;

}  // namespace tetwarp::phantom
