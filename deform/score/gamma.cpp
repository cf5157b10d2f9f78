// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/gamma.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "deform/core/trilinear.h"
#include "deform/cpu/tiles.h"
#include "deform/errors.h"

namespace tetwarp::score {

namespace {

constexpr int kStepsPerDistance = 10;

/// A place near a voxel: how far it is, and what that leaves for the difference of doses.
struct Near {
  double squared = 0;   ///< (distance / most)^2, at most 1
  glm::dvec3 index{0};  ///< offset in voxels
};

/// The places within the distance to agreement, nearest first.
std::vector<Near> places_near(const Geometry& grid, double most_mm) {
  const glm::dmat3 index = index_from_point(grid).linear;
  const double step = most_mm / kStepsPerDistance;
  std::vector<Near> places;
  for (int z = -kStepsPerDistance; z <= kStepsPerDistance; ++z) {
    for (int y = -kStepsPerDistance; y <= kStepsPerDistance; ++y) {
      for (int x = -kStepsPerDistance; x <= kStepsPerDistance; ++x) {
        const int squared = x * x + y * y + z * z;
        if (squared > kStepsPerDistance * kStepsPerDistance) continue;
        places.push_back({static_cast<double>(squared) / (kStepsPerDistance * kStepsPerDistance),
                          index * (step * glm::dvec3(x, y, z))});
      }
    }
  }
  std::stable_sort(places.begin(), places.end(), [](const Near& a, const Near& b) { return a.squared < b.squared; });
  return places;
}

std::vector<float> doses_of(const ConstVolumeView& view) {
  std::vector<float> doses(static_cast<std::size_t>(voxel_count(*view.geometry)));
  dispatch(view.type, [&]<class V>(V) {
    const V* from = reinterpret_cast<const V*>(view.voxels);
    std::transform(from, from + doses.size(), doses.begin(), [](V value) { return static_cast<float>(value); });
  });
  return doses;
}

}  // namespace

GammaScore gamma_score(const ConstVolumeView& reference, const ConstVolumeView& evaluated,
                       const GammaCriterion& criterion, const Limits& limits, const Control& control) {
  for (const ConstVolumeView* view : {&reference, &evaluated}) {
    require(view->voxels && view->memory == Memory::host && view->components == 1 &&
                view->buffered == whole(*view->geometry),
            "doses are compared of whole volumes with one value a voxel in host memory");
  }
  require(*reference.geometry == *evaluated.geometry, "doses are compared on one grid");
  require(criterion.dose_percent > 0 && criterion.distance_mm > 0 && criterion.threshold_percent >= 0,
          "criteria of the gamma index have to be above 0");
  const Geometry& grid = *reference.geometry;
  const glm::i64vec3 size = grid.size;
  const std::vector<float> wanted = doses_of(reference), found = doses_of(evaluated);
  GammaScore score;
  for (const float dose : wanted) score.largest_dose = std::max(score.largest_dose, static_cast<double>(dose));
  require(score.largest_dose > 0, "the reference has no dose above 0");
  const double most = criterion.dose_percent / 100 * score.largest_dose,
               threshold = criterion.threshold_percent / 100 * score.largest_dose;
  const std::vector<Near> places = places_near(grid, criterion.distance_mm);
  const auto passes = [&](const glm::dvec3& index, double dose) {
    return std::any_of(places.begin(), places.end(), [&](const Near& near) {
      const double there = trilinear<double>(size, index + near.index, [&](const glm::i64vec3& at) {
        return static_cast<double>(found[static_cast<std::size_t>(at.x + size.x * (at.y + size.y * at.z))]);
      });
      const double difference = (there - dose) / most;
      return near.squared + difference * difference <= 1;  // false for NaN, outside of the grid
    });
  };
  std::vector<GammaScore> slices(static_cast<std::size_t>(size.z));
  cpu::WorkProgress progress(control, size.z);
  cpu::Arena arena(limits);
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t k) {
      GammaScore& slice = slices[static_cast<std::size_t>(k)];
      auto voxel = static_cast<std::size_t>(k * size.x * size.y);
      for (std::int64_t j = 0; j < size.y; ++j) {
        for (std::int64_t i = 0; i < size.x; ++i, ++voxel) {
          const auto dose = static_cast<double>(wanted[voxel]);
          if (!(dose >= threshold)) continue;
          ++slice.points;
          slice.passing += passes(glm::dvec3(i, j, k), dose);
        }
      }
      progress.done(1);
    });
  });
  for (const GammaScore& slice : slices) {
    score.points += slice.points;
    score.passing += slice.passing;
  }
  return score;
}

}  // namespace tetwarp::score
