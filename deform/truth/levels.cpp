// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/levels.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "deform/cpu/tiles.h"
#include "deform/errors.h"
#include "deform/truth/shapes.h"

namespace tetwarp::truth {

std::vector<glm::dvec3> places_of(const Geometry& lattice, const std::vector<std::uint8_t>& marked) {
  const AffineMap point = point_from_index(lattice);
  std::vector<glm::dvec3> places;
  std::size_t vertex = 0;
  for (std::int64_t k = 0; k < lattice.size.z; ++k) {
    for (std::int64_t j = 0; j < lattice.size.y; ++j) {
      for (std::int64_t i = 0; i < lattice.size.x; ++i, ++vertex)
        if (marked[vertex]) places.push_back(point(glm::dvec3(i, j, k)));
    }
  }
  return places;
}

VertexField on_vertices(const Geometry& lattice, const Limits& limits, const Control& control,
                        const std::function<glm::dvec3(std::size_t, const glm::dvec3&)>& displacement) {
  VertexField field{lattice, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(lattice)))};
  const AffineMap point = point_from_index(lattice);
  const glm::i64vec3 size = lattice.size;
  cpu::WorkProgress progress(control, size.z);
  cpu::Arena arena(limits);
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t k) {
      auto vertex = static_cast<std::size_t>(k * size.x * size.y);
      for (std::int64_t j = 0; j < size.y; ++j) {
        for (std::int64_t i = 0; i < size.x; ++i, ++vertex)
          field.displacement[vertex] = glm::vec3(displacement(vertex, point(glm::dvec3(i, j, k))));
      }
      progress.done(1);
    });
  });
  return field;
}

BreathingLevels::BreathingLevels(const Subject& subject) : held_(subject.vertices("bone")) {
  const Geometry& lattice = subject.lattice();
  const std::vector<std::uint8_t> lung = subject.vertices("lung"), table = subject.table();
  for (std::size_t n = 0; n < held_.size(); ++n) held_[n] |= table[n];
  const AffineMap point = point_from_index(lattice);
  std::vector<double> lowest;
  double top = -std::numeric_limits<double>::infinity();
  const glm::i64vec3 size = lattice.size;
  for (std::int64_t j = 0; j < size.y; ++j) {
    for (std::int64_t i = 0; i < size.x; ++i) {
      double low = std::numeric_limits<double>::infinity();
      for (std::int64_t k = 0; k < size.z; ++k) {
        if (!lung[static_cast<std::size_t>(i + size.x * (j + size.y * k))]) continue;
        const double z = point(glm::dvec3(i, j, k)).z;
        low = std::min(low, z);
        top = std::max(top, z);
      }
      if (low < top + 1) lowest.push_back(low);
    }
  }
  std::sort(lowest.begin(), lowest.end());
  diaphragm_ = lowest[lowest.size() / 2];
  reach_ = 0.9 * (top - diaphragm_);
  require(reach_ > 0, "the lungs are flat; breathing needs a label of both lungs");
  const auto& box = subject.patient().box;
  require(box.has_value(), "the volume holds no body; breathing needs one");
  front_ = box->low.y;
  depth_ = box->high.y - box->low.y;
}

double BreathingLevels::hill_at(double z) const { return hill((z - diaphragm_) / reach_); }

double BreathingLevels::front_at(double y) const { return std::clamp(1 - (y - front_) / depth_, 0.0, 1.0); }

}  // namespace tetwarp::truth
