// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/sampled_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace tetwarp::viewer {

namespace {

/// A place between two vertices of an axis.
struct Between {
  std::int64_t first = 0;  ///< vertex before it
  float share = 0;         ///< of the next vertex, 0 to 1
};

/// Where the points of an axis lie among `count` vertices; empty if one lies more than half a step outside.
/// @param begin, step  index of the first point, and from one to the next, in vertices
std::optional<std::vector<Between>> places(std::int64_t points, std::int64_t count, double begin, double step) {
  const double slack = std::max(1e-6, 0.5 * step);  // vertices; the least is what rounding in the geometry may come to
  std::vector<Between> found;
  found.reserve(static_cast<std::size_t>(points));
  for (std::int64_t n = 0; n < points; ++n) {
    const double index = begin + static_cast<double>(n) * step;
    if (!(index >= -slack && index <= static_cast<double>(count - 1) + slack)) return std::nullopt;
    const auto first = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(index)), 0, count - 2);
    found.push_back({first, static_cast<float>(std::clamp(index - static_cast<double>(first), 0.0, 1.0))});
  }
  return found;
}

}  // namespace

bool sample_field(const FieldView& field, VertexField& samples) {
  if (field.mesh != nullptr || field.lattice == nullptr || field.memory != Memory::host) return false;
  const Geometry &lattice = *field.lattice, &grid = samples.lattice;
  const glm::i64vec3 size = lattice.size, count = grid.size;
  if (lattice.direction != grid.direction || !grid.slices.empty() || std::min({size.x, size.y, size.z}) < 2)
    return false;
  const glm::dvec3 begin = index_from_point(lattice)(grid.origin), step = grid.spacing / lattice.spacing;
  const auto along_x = places(count.x, size.x, begin.x, step.x), along_y = places(count.y, size.y, begin.y, step.y),
             along_z = places(count.z, size.z, begin.z, step.z);
  if (!along_x || !along_y || !along_z) return false;
  samples.displacement.resize(static_cast<std::size_t>(voxel_count(grid)));
  tbb::parallel_for(std::int64_t{0}, count.z, [&](std::int64_t k) {
    const Between z = (*along_z)[static_cast<std::size_t>(k)];
    std::vector<glm::vec3> row(static_cast<std::size_t>(size.x));  // of vertices, between rows of the lattice
    for (std::int64_t j = 0; j < count.y; ++j) {
      const Between y = (*along_y)[static_cast<std::size_t>(j)];
      const glm::vec3* const lower = field.displacement + (z.first * size.y + y.first) * size.x;
      const glm::vec3* const upper = lower + size.y * size.x;
      for (std::int64_t i = 0; i < size.x; ++i)
        row[static_cast<std::size_t>(i)] = glm::mix(glm::mix(lower[i], lower[i + size.x], y.share),
                                                    glm::mix(upper[i], upper[i + size.x], y.share), z.share);
      glm::vec3* const to = samples.displacement.data() + (k * count.y + j) * count.x;
      for (std::int64_t i = 0; i < count.x; ++i) {
        const Between x = (*along_x)[static_cast<std::size_t>(i)];
        const glm::vec3* const from = row.data() + x.first;
        to[i] = glm::mix(from[0], from[1], x.share);
      }
    }
  });
  return true;
}

}  // namespace tetwarp::viewer
