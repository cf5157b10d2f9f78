// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/continued.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "deform/errors.h"

namespace tetwarp {
namespace {

constexpr double kMostGrowth = 8;

/// The box around the target's corners, in the field's index.
struct IndexBox {
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
};

IndexBox corners_of(const Geometry& target, const Geometry& grid) {
  const AffineMap index = index_from_point(grid) * point_from_index(target);
  IndexBox box;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at =
        index(glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(target.size - std::int64_t{1}));
    box.low = glm::min(box.low, at);
    box.high = glm::max(box.high, at);
  }
  return box;
}

/// How many cells are added before and behind the samples on each axis, so that each face of the lattice is moved onto
/// the target's face or beyond it.
struct Growth {
  glm::dvec3 before{0}, behind{0};
};

Growth growth_over(const PullField& field, const IndexBox& target) {
  const glm::i64vec3 size = field.grid.size;
  const AffineMap index = index_from_point(field.grid);
  Growth growth;
  std::size_t n = 0;
  for (std::int64_t k = 0; k < size.z; ++k) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i, ++n) {
        const glm::vec3& d = field.displacement[n];
        require(std::isfinite(d.x) && std::isfinite(d.y) && std::isfinite(d.z),
                "a pull field that has no place at sample (" + std::to_string(i) + ", " + std::to_string(j) + ", " +
                    std::to_string(k) + "), where its inverse needs one");
        const glm::i64vec3 at(i, j, k);
        const glm::dvec3 by = index.linear * glm::dvec3(d);
        for (int axis = 0; axis < 3; ++axis) {
          // One cell more than needed, for vertices are snapped.
          const auto last = static_cast<double>(size[axis] - 1);
          if (at[axis] == 0)
            growth.before[axis] = std::max(growth.before[axis], std::ceil(by[axis] - target.low[axis]) + 1);
          if (at[axis] == size[axis] - 1)
            growth.behind[axis] = std::max(growth.behind[axis], std::ceil(target.high[axis] - last - by[axis]) + 1);
        }
      }
    }
  }
  return growth;
}

}  // namespace

VertexField continued_over(const PullField& field, const Geometry& target) {
  view(field);  // throws unless there is one displacement a sample
  const Growth growth = growth_over(field, corners_of(target, field.grid));
  const glm::dvec3 grown = glm::dvec3(field.grid.size) + growth.before + growth.behind;
  const double most = kMostGrowth * static_cast<double>(voxel_count(field.grid) + voxel_count(target));
  require(grown.x * grown.y * grown.z <= most,
          "a pull field of " + to_string(field.grid.size) + " samples that lies far from the grid of " +
              to_string(target.size) +
              " voxels on which its inverse is wanted; give the volume that it takes values from");
  const glm::i64vec3 before(growth.before), size(grown), last = field.grid.size - std::int64_t{1};
  VertexField result{field.grid, {}};
  result.lattice.size = size;
  result.lattice.origin = point_from_index(field.grid)(-growth.before);
  result.displacement.reserve(static_cast<std::size_t>(voxel_count(result.lattice)));
  for (std::int64_t k = 0; k < size.z; ++k) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) {
        const glm::i64vec3 from = glm::clamp(glm::i64vec3(i, j, k) - before, glm::i64vec3(0), last);
        result.displacement.push_back(field.displacement[static_cast<std::size_t>(
            from.x + field.grid.size.x * (from.y + field.grid.size.y * from.z))]);
      }
    }
  }
  return result;
}

}  // namespace tetwarp
