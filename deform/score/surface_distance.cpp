// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/surface_distance.h"

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <vector>

#include "deform/cpu/tiles.h"
#include "deform/distance_map.h"
#include "deform/errors.h"
#include "deform/score/error_sums.h"
#include "deform/score/label_map.h"

namespace tetwarp::score {

namespace {

constexpr std::array<glm::i64vec3, 6> kNeighbours{glm::i64vec3(-1, 0, 0), glm::i64vec3(1, 0, 0),
                                                  glm::i64vec3(0, -1, 0), glm::i64vec3(0, 1, 0),
                                                  glm::i64vec3(0, 0, -1), glm::i64vec3(0, 0, 1)};

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
std::vector<std::uint8_t> surface_of(const ConstVolumeView& map, std::int64_t label, const Region& box) {
  const glm::i64vec3 size = map.geometry->size;
  std::vector<std::uint8_t> marks;
  marks.reserve(static_cast<std::size_t>(voxel_count(box)));
  dispatch(map.type, [&]<class V>(V) {
    const V* labels = reinterpret_cast<const V*>(map.voxels);
    const auto is_it = [&](const glm::i64vec3& at) {
      return static_cast<std::int64_t>(labels[at.x + size.x * (at.y + size.y * at.z)]) == label;
    };
    for (std::int64_t k = box.begin.z; k < box.end.z; ++k) {
      for (std::int64_t j = box.begin.y; j < box.end.y; ++j) {
        for (std::int64_t i = box.begin.x; i < box.end.x; ++i) {
          const glm::i64vec3 at(i, j, k);
          marks.push_back(is_it(at) && std::any_of(kNeighbours.begin(), kNeighbours.end(), [&](const auto& step) {
                            const glm::i64vec3 beside = at + step;
                            return glm::clamp(beside, glm::i64vec3(0), size - std::int64_t{1}) == beside &&
                                   !is_it(beside);
                          }));
        }
      }
    }
  });
  return marks;
}

/// Adds the distance of each mark from the nearest of others; infinite: it is missing.
void add_distances(const Geometry& grid, const std::vector<std::uint8_t>& from, const std::vector<std::uint8_t>& to,
                   const Limits& limits, ErrorSums& sums) {
  const std::vector<double> distance = distance_mm(grid, to, limits);
  const AffineMap point = point_from_index(grid);
  std::size_t n = 0;
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i, ++n)
        if (from[n]) sums.add_or_miss(distance[n], point(glm::dvec3(i, j, k)));
    }
  }
}

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
  for (const auto& [label, box] : boxes) {
    const std::vector<std::uint8_t> one = surface_of(first, label, box), other = surface_of(second, label, box);
    Geometry grid = *first.geometry;
    grid.origin = point_from_index(grid)(glm::dvec3(box.begin));
    grid.size = box.end - box.begin;
    ErrorSums sums;
    add_distances(grid, one, other, limits, sums);
    add_distances(grid, other, one, limits, sums);
    distances[label] = sums.errors();
    progress.done(1);
  }
  return distances;
}

}  // namespace tetwarp::score
