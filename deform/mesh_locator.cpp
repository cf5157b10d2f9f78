// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/mesh_locator.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace tetwarp {

namespace {

/// The largest negative weight that counts as rounding: the tetrahedron holds the point.
constexpr double kRounding = 1e-9;
/// How far outside a mesh a point may lie by rounding of vertices and of its own coordinates, in steps (2^-12 voxel).
constexpr double kOutside = 1;

/// The undeformed corners of a tetrahedron, in steps (2^-12 voxel).
struct RestCorners {
  glm::dvec3 a, b, c, d;

  explicit RestCorners(const Tetrahedron& t) : a(rest(t.a)), b(rest(t.b)), c(rest(t.c)), d(rest(t.d)) {}
  static glm::dvec3 rest(const Vertex& v) { return glm::dvec3(v.deformed + v.u); }
  glm::dvec3 low() const { return glm::min(glm::min(a, b), glm::min(c, d)); }
  glm::dvec3 high() const { return glm::max(glm::max(a, b), glm::max(c, d)); }
};

}  // namespace

MeshLocator::MeshLocator(const SnappedMesh& mesh) : mesh_(mesh) {
  constexpr double kMostCells = 1 << 22;
  const std::size_t count = mesh.tetrahedra.size();
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (std::size_t n = 0; n < count; ++n) {
    const RestCorners at(mesh.tetrahedron(n));
    low = glm::min(low, at.low());
    high = glm::max(high, at.high());
  }
  low_ = low - 2 * kOutside;
  const glm::dvec3 extent = high - low + 4 * kOutside;
  const double side = std::cbrt(extent.x * extent.y * extent.z / std::min(static_cast<double>(count), kMostCells));
  cells_ = glm::i64vec3(glm::clamp(glm::ceil(extent / side), 1.0, 1024.0));
  cell_ = extent / glm::dvec3(cells_);
  const auto for_each_pair = [&](auto&& visit) {
    for (std::size_t n = 0; n < count; ++n) {
      const RestCorners at(mesh.tetrahedron(n));
      glm::i64vec3 begin, end;
      for (int axis = 0; axis < 3; ++axis) {
        begin[axis] = cell_on_axis(axis, at.low()[axis] - kOutside);
        end[axis] = cell_on_axis(axis, at.high()[axis] + kOutside);
      }
      for (std::int64_t z = begin.z; z <= end.z; ++z) {
        for (std::int64_t y = begin.y; y <= end.y; ++y) {
          for (std::int64_t x = begin.x; x <= end.x; ++x)
            visit(static_cast<std::size_t>((z * cells_.y + y) * cells_.x + x), n);
        }
      }
    }
  };
  lists_.build(static_cast<std::size_t>(cells_.x * cells_.y * cells_.z), for_each_pair);
}

std::int64_t MeshLocator::cell_on_axis(int axis, double at) const {
  const auto cell = static_cast<std::int64_t>(std::floor((at - low_[axis]) / cell_[axis]));
  return std::clamp<std::int64_t>(cell, 0, cells_[axis] - 1);
}

std::optional<MeshLocator::Location> MeshLocator::find(const glm::dvec3& steps) const {
  glm::i64vec3 cell;
  for (int axis = 0; axis < 3; ++axis) {
    const double in = (steps[axis] - low_[axis]) / cell_[axis];
    if (!(in >= 0 && in <= static_cast<double>(cells_[axis]))) return std::nullopt;
    cell[axis] = cell_on_axis(axis, steps[axis]);
  }
  const auto number = static_cast<std::size_t>((cell.z * cells_.y + cell.y) * cells_.x + cell.x);
  std::optional<Location> nearest;
  double least_outside = -kOutside;
  for (const std::uint32_t* t = lists_.begin(number); t != lists_.end(number); ++t) {
    const RestCorners at(mesh_.tetrahedron(*t));
    const glm::dmat3 edges(at.a - at.d, at.b - at.d, at.c - at.d);
    if (glm::determinant(edges) == 0) continue;
    const glm::dmat3 weights_from_place = glm::inverse(edges);
    const glm::dvec3 w = weights_from_place * (steps - at.d);
    const double of_d = 1 - w.x - w.y - w.z;
    if (std::min({w.x, w.y, w.z, of_d}) >= -kRounding) return Location{*t, w};
    const glm::dmat3 rows = glm::transpose(weights_from_place);  // how fast each weight changes from place to place
    const double distance = std::min({w.x / glm::length(rows[0]), w.y / glm::length(rows[1]),
                                      w.z / glm::length(rows[2]), of_d / glm::length(rows[0] + rows[1] + rows[2])});
    if (distance <= least_outside) continue;
    least_outside = distance;
    nearest = Location{*t, w};
  }
  return nearest;
}

}  // namespace tetwarp
