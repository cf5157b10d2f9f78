// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/surface_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <vector>

#include "deform/cpu/distance_map.h"
#include "deform/cpu/tiles.h"
#include "deform/errors.h"
#include "deform/score/error_sums.h"
#include "deform/score/label_map.h"

namespace tetwarp::score {

namespace {

/// The box around each label but 0.
std::map<std::int64_t, Region> boxes_of(const ConstVolumeView& map) {
  const glm::i64vec3 size = map.geometry->size;
  std::map<std::int64_t, Region> boxes;
  dispatch(map.type, [&]<class V>(V) {
    const V* labels = reinterpret_cast<const V*>(map.voxels);
    // Labels come in runs, so the box of the last one is at hand.
    V last = 0;
    Region* box = nullptr;
    for (std::int64_t k = 0; k < size.z; ++k) {
      for (std::int64_t j = 0; j < size.y; ++j) {
        for (std::int64_t i = 0; i < size.x; ++i) {
          const V label = *labels++;
          if (label == 0) continue;
          const glm::i64vec3 at(i, j, k);
          if (!box || label != last) {
            last = label;
            box = &boxes.try_emplace(static_cast<std::int64_t>(label), Region{at, at + std::int64_t{1}}).first->second;
          }
          *box = {glm::min(box->begin, at), glm::max(box->end, at + std::int64_t{1})};
        }
      }
    }
  });
  return boxes;
}

/// Marks the surface of a label within a box.
template <class V>
std::vector<std::uint8_t> surface_of(const V* labels, const glm::i64vec3& size, V label, const Region& box) {
  const glm::i64vec3 extent = box.end - box.begin;
  std::vector<std::uint8_t> marks(static_cast<std::size_t>(voxel_count(box)));
  const std::array<std::int64_t, 3> strides{1, size.x, size.x * size.y};
  tbb::parallel_for(std::int64_t{0}, extent.y * extent.z, [&](std::int64_t row) {
    glm::i64vec3 at = box.begin + glm::i64vec3(0, row % extent.y, row / extent.y);
    std::uint8_t* mark = marks.data() + row * extent.x;
    const V* voxel = labels + at.x + size.x * (at.y + size.y * at.z);
    for (; at.x < box.end.x; ++at.x, ++voxel, ++mark) {
      if (*voxel != label) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t stride = strides[static_cast<std::size_t>(axis)];
        *mark |= (at[axis] > 0 && voxel[-stride] != label) || (at[axis] + 1 < size[axis] && voxel[stride] != label);
      }
    }
  });
  return marks;
}

std::vector<std::uint8_t> surface_of(const ConstVolumeView& map, std::int64_t label, const Region& box) {
  return dispatch(map.type, [&]<class V>(V) {
    return surface_of(reinterpret_cast<const V*>(map.voxels), map.geometry->size, static_cast<V>(label), box);
  });
}

/// A step to a voxel nearby.
struct Step {
  glm::i64vec3 by;
  double squared_mm;
};

/// The steps to all voxels up to four largest sides of a voxel away, nearest first.
std::vector<Step> steps_nearby(const glm::dvec3& spacing) {
  const double most = 4 * std::max({spacing.x, spacing.y, spacing.z});
  const glm::i64vec3 reach(most / spacing);
  std::vector<Step> steps;
  for (std::int64_t z = -reach.z; z <= reach.z; ++z) {
    for (std::int64_t y = -reach.y; y <= reach.y; ++y) {
      for (std::int64_t x = -reach.x; x <= reach.x; ++x) {
        const glm::dvec3 by = spacing * glm::dvec3(x, y, z);
        const double squared = by.z * by.z + (by.y * by.y + by.x * by.x);  // as distance_mm adds
        if (squared <= most * most) steps.push_back({{x, y, z}, squared});
      }
    }
  }
  std::stable_sort(steps.begin(), steps.end(),
                   [](const Step& a, const Step& b) { return a.squared_mm < b.squared_mm; });
  return steps;
}

/// Distances from the marks of one map to those of another. Surfaces mostly lie near each other, so what is nearby is
/// looked at first; the rest takes a map of distances.
class MarkDistances {
 public:
  MarkDistances(const Geometry& grid, const Limits& limits)
      : grid_(grid), point_(point_from_index(grid)), steps_(steps_nearby(grid.spacing)), limits_(limits) {}

  /// Adds the distance of each mark in `from` to the nearest one in `to`; without any, it is missing.
  void add(const std::vector<std::uint8_t>& from, const std::vector<std::uint8_t>& to, ErrorSums& sums) const {
    std::vector<ErrorSums> slices(static_cast<std::size_t>(grid_.size.z));
    std::atomic<bool> all_found = true;
    for_slices(from, slices, [&](const glm::i64vec3& at, std::size_t) {
      const double distance = nearby(to, at);
      if (std::isinf(distance)) all_found = false;
      return distance;
    });
    if (!all_found) {
      const std::vector<double> distance = distance_mm(grid_, to, limits_);
      slices.assign(slices.size(), {});
      for_slices(from, slices, [&](const glm::i64vec3&, std::size_t voxel) { return distance[voxel]; });
    }
    for (const ErrorSums& slice : slices) sums.add(slice);
  }

 private:
  template <class Find>
  void for_slices(const std::vector<std::uint8_t>& from, std::vector<ErrorSums>& slices, const Find& find) const {
    tbb::parallel_for(std::int64_t{0}, grid_.size.z, [&](std::int64_t k) {
      auto n = static_cast<std::size_t>(k * grid_.size.x * grid_.size.y);
      for (std::int64_t j = 0; j < grid_.size.y; ++j) {
        for (std::int64_t i = 0; i < grid_.size.x; ++i, ++n)
          if (from[n]) slices[static_cast<std::size_t>(k)].add_or_miss(find({i, j, k}, n), point_(glm::dvec3(i, j, k)));
      }
    });
  }
  /// Distance of a voxel from the nearest mark among the steps; infinite: there is none.
  double nearby(const std::vector<std::uint8_t>& marks, const glm::i64vec3& at) const {
    for (const Step& step : steps_) {
      const glm::i64vec3 there = at + step.by;
      if (glm::clamp(there, glm::i64vec3(0), grid_.size - std::int64_t{1}) != there) continue;
      if (marks[static_cast<std::size_t>(there.x + grid_.size.x * (there.y + grid_.size.y * there.z))])
        return std::sqrt(step.squared_mm);
    }
    return INFINITY;
  }

  const Geometry& grid_;
  AffineMap point_;
  std::vector<Step> steps_;
  Limits limits_;
};

}  // namespace

std::map<std::int64_t, Errors> surface_distances(const ConstVolumeView& first, const ConstVolumeView& second,
                                                 const Limits& limits, const Control& control) {
  require_label_maps(first, second);
  require(!is_sheared(*first.geometry) && first.geometry->slices.empty(),
          "distances of surfaces are measured on an even grid whose axes are perpendicular");
  std::map<std::int64_t, Region> boxes = boxes_of(first);
  for (const auto& [label, box] : boxes_of(second)) {
    Region& all = boxes.try_emplace(label, box).first->second;
    all = {glm::min(all.begin, box.begin), glm::max(all.end, box.end)};
  }
  std::map<std::int64_t, Errors> distances;
  cpu::WorkProgress progress(control, std::ssize(boxes));
  cpu::Arena arena(limits);
  for (const auto& [label, box] : boxes) {
    Geometry grid = *first.geometry;
    grid.origin = point_from_index(grid)(glm::dvec3(box.begin));
    grid.size = box.end - box.begin;
    ErrorSums sums;
    arena.execute([&, label = label, box = box] {
      const std::vector<std::uint8_t> one = surface_of(first, label, box), other = surface_of(second, label, box);
      const MarkDistances distances_between(grid, limits);
      distances_between.add(one, other, sums);
      distances_between.add(other, one, sums);
    });
    distances[label] = sums.errors();
    progress.done(1);
  }
  return distances;
}

}  // namespace tetwarp::score
