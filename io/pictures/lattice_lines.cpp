// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/lattice_lines.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "io/overlay.h"

namespace tetwarp {

namespace {

constexpr Tint kLine = {{90, 220, 255}, 0.7};
constexpr double kLineEvery = 14;  ///< the least distance of two lines in pixels

/// The layer of vertices in the middle of the lattice that faces the viewer, with the place of each in the picture.
class Layer {
 public:
  Layer(const ViewPlane& plane, const VertexField& field)
      : plane_(plane), field_(field), point_(point_from_index(field.lattice)) {
    double most = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const double along = std::abs(glm::dot(glm::normalize(point_.linear[axis]), plane.forward));
      if (along > most) most = along, normal_ = axis;
    }
    middle_ = (field.lattice.size[normal_] - 1) / 2;
  }

  int right() const { return normal_ == 0 ? 1 : 0; }
  int up() const { return normal_ == 2 ? 1 : 2; }
  std::int64_t size(int axis) const { return field_.lattice.size[axis]; }
  /// How many vertices apart neighbouring lines across an axis are.
  std::int64_t every(int axis) const {
    const double apart = field_.lattice.spacing[axis] / plane_.pixel_mm;
    return std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(kLineEvery / apart)));
  }
  glm::dvec3 at(std::int64_t a, std::int64_t b) const {
    glm::i64vec3 vertex;
    vertex[normal_] = middle_;
    vertex[right()] = a;
    vertex[up()] = b;
    const glm::i64vec3& size = field_.lattice.size;
    const auto number = static_cast<std::size_t>((vertex.z * size.y + vertex.y) * size.x + vertex.x);
    return plane_.project(point_(glm::dvec3(vertex)) + glm::dvec3(field_.displacement[number]));
  }

 private:
  const ViewPlane& plane_;
  const VertexField& field_;
  AffineMap point_;
  int normal_ = 0;
  std::int64_t middle_ = 0;
};

/// Draws a straight line, a pixel wide, up to but without its end. No pixel is drawn twice, so that a line that
/// continues it is not brighter where they meet.
void draw_line(Picture& picture, const glm::dvec3& from, const glm::dvec3& to) {
  const double length = std::max(std::abs(to.x - from.x), std::abs(to.y - from.y));
  if (!(length < 1e5)) return;
  const int steps = std::max(1, static_cast<int>(std::ceil(length)));
  int last_x = -1, last_y = -1;
  for (int n = 0; n < steps; ++n) {
    const glm::dvec3 at = from + (to - from) * (static_cast<double>(n) / steps);
    const int x = static_cast<int>(std::floor(at.x)), y = static_cast<int>(std::floor(at.y));
    if ((x == last_x && y == last_y) || x < 0 || y < 0 || x >= picture.width() || y >= picture.height()) continue;
    picture.set(x, y, mixed(picture.at(x, y), kLine));
    last_x = x;
    last_y = y;
  }
}

}  // namespace

void draw_lattice(Picture& picture, const ViewPlane& plane, const VertexField& field) {
  const Layer layer(plane, field);
  const int right = layer.right(), up = layer.up();
  for (std::int64_t b = 0; b < layer.size(up); b += layer.every(up)) {
    for (std::int64_t a = 0; a + 1 < layer.size(right); ++a) draw_line(picture, layer.at(a, b), layer.at(a + 1, b));
  }
  for (std::int64_t a = 0; a < layer.size(right); a += layer.every(right)) {
    for (std::int64_t b = 0; b + 1 < layer.size(up); ++b) draw_line(picture, layer.at(a, b), layer.at(a, b + 1));
  }
}

}  // namespace tetwarp
