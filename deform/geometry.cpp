// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <sstream>

#include "deform/errors.h"

namespace tetwarp {

AffineMap inverse_of(const AffineMap& map) {
  const glm::dmat3 inverse = glm::inverse(map.linear);
  return {inverse, -(inverse * map.offset)};
}

AffineMap point_from_index(const Geometry& geometry) {
  glm::dmat3 linear = geometry.direction;
  for (int axis = 0; axis < 3; ++axis) linear[axis] *= geometry.spacing[axis];
  return {linear, geometry.origin};
}

AffineMap index_from_point(const Geometry& geometry) {
  const AffineMap forward = point_from_index(geometry);
  const double volume = glm::determinant(forward.linear);
  require(std::isfinite(volume) && volume != 0, "the grid's spacing and direction have no inverse");
  return inverse_of(forward);
}

std::int64_t voxel_count(const Geometry& geometry) { return geometry.size.x * geometry.size.y * geometry.size.z; }

std::int64_t voxel_count(const Region& region) {
  if (is_empty(region)) return 0;
  const glm::i64vec3 size = region.end - region.begin;
  return size.x * size.y * size.z;
}

Region whole(const Geometry& geometry) { return {glm::i64vec3(0), geometry.size}; }

bool contains(const Region& outer, const Region& inner) {
  return is_empty(inner) || intersection(outer, inner) == inner;
}

Region intersection(const Region& a, const Region& b) { return {glm::max(a.begin, b.begin), glm::min(a.end, b.end)}; }

glm::dvec3 centre(const Geometry& geometry) {
  return point_from_index(geometry)(0.5 * glm::dvec3(geometry.size - std::int64_t{1}));
}

bool same_grid(const Geometry& a, const Geometry& b, double tolerance_mm) {
  if (a.size != b.size || a.slices.size() != b.slices.size()) return false;
  for (std::size_t k = 0; k < a.slices.size(); ++k) {
    if (!(std::abs(a.slices[k] - b.slices[k]) <= tolerance_mm)) return false;
  }
  const AffineMap point_a = point_from_index(a), point_b = point_from_index(b);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index =
        glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(a.size - std::int64_t{1});
    if (!(glm::distance(point_a(index), point_b(index)) <= tolerance_mm)) return false;
  }
  return true;
}

Geometry lattice_over(const Geometry& volume, std::int64_t cell_size) {
  require(cell_size >= 1, [&] { return "cell size " + std::to_string(cell_size) + ", expected at least 1 voxel"; });
  for (int axis = 0; axis < 3; ++axis) {
    require(volume.size[axis] >= 2, [&] {
      return "a volume of " + to_string(volume.size) + " voxels has no cell: deforming needs at least 2 on every axis";
    });
  }
  Geometry lattice = volume;
  lattice.slices.clear();
  lattice.size = (volume.size - std::int64_t{1} + (cell_size - 1)) / cell_size + std::int64_t{1};
  lattice.spacing = volume.spacing * static_cast<double>(cell_size);
  return lattice;
}

bool is_sheared(const Geometry& geometry) {
  constexpr double kRounding = 1e-6;
  const glm::dmat3& axes = geometry.direction;
  return std::abs(glm::dot(axes[0], axes[1])) > kRounding || std::abs(glm::dot(axes[0], axes[2])) > kRounding ||
         std::abs(glm::dot(axes[1], axes[2])) > kRounding;
}

Geometry straightened(const Geometry& geometry) {
  if (geometry.slices.empty() && !is_sheared(geometry)) return geometry;
  constexpr double kNearly = 1.0 / 1024;  // voxels, so that rounding adds no voxel
  Geometry grid{geometry.size, geometry.spacing, geometry.origin, geometry.direction};
  const glm::dvec3 row = geometry.direction[0];
  const glm::dvec3 column = glm::normalize(geometry.direction[1] - glm::dot(geometry.direction[1], row) * row);
  const glm::dvec3 normal = glm::cross(row, column);
  grid.direction = {row, column, glm::dot(normal, geometry.direction[2]) < 0 ? -normal : normal};
  double step = geometry.spacing.z;
  for (std::size_t k = 1; k < geometry.slices.size(); ++k)
    step = std::min(step, geometry.slices[k] - geometry.slices[k - 1]);
  grid.spacing.z = step * glm::dot(geometry.direction[2], grid.direction[2]);
  const AffineMap index = index_from_point(grid) * point_from_index(geometry);
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at =
        index(glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(geometry.size - std::int64_t{1}));
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  const glm::i64vec3 first(glm::floor(low + kNearly)), last(glm::ceil(high - kNearly));
  grid.origin = point_from_index(grid)(glm::dvec3(first));
  grid.size = last - first + std::int64_t{1};
  return grid;
}

std::string orientation_code(const Geometry& geometry) {
  constexpr std::array<const char*, 3> kLetters = {"LR", "PA", "SI"};
  std::string code;
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 direction = geometry.direction[axis], size = glm::abs(direction);
    const int patient = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
    code += kLetters[static_cast<std::size_t>(patient)][direction[patient] < 0 ? 1 : 0];
  }
  return code;
}

namespace {

void require_valid_slices(const Geometry& geometry, const std::string& what) {
  const std::vector<double>& slices = geometry.slices;
  require(std::ssize(slices) == geometry.size.z && geometry.size.z >= 2, [&] {
    return what + ": " + std::to_string(slices.size()) + " places of slices, expected one for each of " +
           std::to_string(geometry.size.z) + ", at least 2";
  });
  for (std::size_t k = 1; k < slices.size(); ++k) {
    require(std::isfinite(slices[k]) && slices[k] > slices[k - 1], [&] {
      return what + ": slice " + std::to_string(k) + " lies at " + std::to_string(slices[k]) +
             " mm, the one before at " + std::to_string(slices[k - 1]) + " mm, expected rising places";
    });
  }
  const double last = geometry.spacing.z * static_cast<double>(geometry.size.z - 1);
  require(slices.front() == 0 && std::abs(slices.back() - last) <= 1e-9 * last, [&] {
    return what + ": slices lie from " + std::to_string(slices.front()) + " to " + std::to_string(slices.back()) +
           " mm, expected 0 to " + std::to_string(last) + ", by their mean distance";
  });
}

}  // namespace

void require_valid(const Geometry& geometry, const std::string& what) {
  for (int axis = 0; axis < 3; ++axis) {
    require(geometry.size[axis] >= 1,
            [&] { return what + ": size " + to_string(geometry.size) + ", expected at least 1 on every axis"; });
    require(is_spacing(geometry.spacing[axis]), [&] {
      std::ostringstream text;
      text << what << ": spacing " << geometry.spacing[axis] << " mm on axis " << axis
           << ", expected a positive number from 1e-6 to 1e6";
      return text.str();
    });
    require(std::isfinite(geometry.origin[axis]), [&] { return what + ": the origin is not finite"; });
  }
  const double determinant = glm::determinant(geometry.direction);
  require(std::isfinite(determinant) && std::abs(determinant) > 1e-6, [&] {
    return what + ": the direction's columns do not span space (determinant " + std::to_string(determinant) + ")";
  });
  if (!geometry.slices.empty()) require_valid_slices(geometry, what);
}

std::string to_string(const glm::i64vec3& size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y) + " x " + std::to_string(size.z);
}

}  // namespace tetwarp
