// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/surface_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/support/fields.h"
#include "tests/support/random.h"

namespace tetwarp::score {
namespace {

using namespace test;

/// A box of a label.
void fill(Volume<std::uint8_t>& map, const glm::i64vec3& begin, const glm::i64vec3& end, std::uint8_t label) {
  const glm::i64vec3 size = map.geometry.size;
  for (std::int64_t k = begin.z; k < end.z; ++k)
    for (std::int64_t j = begin.y; j < end.y; ++j)
      for (std::int64_t i = begin.x; i < end.x; ++i)
        map.voxels[static_cast<std::size_t>(i + size.x * (j + size.y * k))] = label;
}

Volume<std::uint8_t> empty(const Geometry& grid) {
  return {grid, std::vector<std::uint8_t>(static_cast<std::size_t>(voxel_count(grid)))};
}

TEST(SurfaceDistance, AShiftedBoxIsOffByItsShiftAcrossIt) {
  const Geometry grid{.size = {30, 20, 16}, .spacing = {0.5, 2, 3}};
  Volume<std::uint8_t> first = empty(grid), second = first;
  fill(first, {5, 5, 4}, {15, 12, 10}, 1);
  fill(second, {9, 5, 4}, {19, 12, 10}, 1);
  const auto distances = surface_distances(view(first), view(second));
  ASSERT_EQ(distances.size(), 1U);
  const Errors& errors = distances.at(1);
  EXPECT_DOUBLE_EQ(errors.largest, 4 * 0.5);
  EXPECT_EQ(errors.missing, 0U);
  // 10 x 7 x 6 less 8 x 5 x 4, twice.
  EXPECT_EQ(errors.points, 2U * (420 - 160));
  EXPECT_GT(errors.mean, 0);
  EXPECT_LT(errors.mean, 2);
  const auto same = surface_distances(view(first), view(first));
  EXPECT_EQ(same.at(1).largest, 0);
  EXPECT_EQ(same.at(1).percentile_95, 0);
}

TEST(SurfaceDistance, SurfacesFarFromEachOtherAreMeasuredToo) {
  const Geometry grid{.size = {90, 12, 10}, .spacing = {1, 2, 3}};
  Volume<std::uint8_t> first = empty(grid), second = first;
  fill(first, {5, 4, 4}, {8, 7, 7}, 2);
  fill(second, {65, 4, 4}, {68, 7, 7}, 2);
  const Errors errors = surface_distances(view(first), view(second)).at(2);
  EXPECT_EQ(errors.points, 52U);
  EXPECT_EQ(errors.largest, 60);
  // From each of the three columns to the nearest face: 9, 8 and 9 voxels at 58, 59 and 60 mm.
  EXPECT_NEAR(errors.mean, (9 * 58.0 + 8 * 59.0 + 9 * 60.0) / 26, 1e-12);
}

TEST(SurfaceDistance, IsThatOfASearchOverAllPairs) {
  const Geometry grid = oblique_grid({14, 12, 10});
  Random random(5);
  Volume<std::uint8_t> first = empty(grid), second = first;
  for (Volume<std::uint8_t>* map : {&first, &second})
    for (std::uint8_t& voxel : map->voxels)
      voxel = static_cast<std::uint8_t>(std::max<std::int64_t>(random.integer(-3, 2), 0));
  const auto distances = surface_distances(view(first), view(second), {.threads = 2});
  const AffineMap point = point_from_index(grid);
  const auto surface = [&](const Volume<std::uint8_t>& map, std::uint8_t label) {
    std::vector<glm::dvec3> found;
    const auto at = [&](std::int64_t i, std::int64_t j, std::int64_t k) {
      return map.voxels[static_cast<std::size_t>(i + 14 * (j + 12 * k))];
    };
    for (std::int64_t k = 0; k < 10; ++k)
      for (std::int64_t j = 0; j < 12; ++j)
        for (std::int64_t i = 0; i < 14; ++i) {
          if (at(i, j, k) != label) continue;
          const bool is_surface = (i > 0 && at(i - 1, j, k) != label) || (i < 13 && at(i + 1, j, k) != label) ||
                                  (j > 0 && at(i, j - 1, k) != label) || (j < 11 && at(i, j + 1, k) != label) ||
                                  (k > 0 && at(i, j, k - 1) != label) || (k < 9 && at(i, j, k + 1) != label);
          if (is_surface) found.push_back(point(glm::dvec3(i, j, k)));
        }
    return found;
  };
  ASSERT_EQ(distances.size(), 2U);
  for (const std::uint8_t label : {std::uint8_t{1}, std::uint8_t{2}}) {
    const auto a = surface(first, label), b = surface(second, label);
    double sum = 0, largest = 0;
    for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
      for (const glm::dvec3& p : *from) {
        double nearest = INFINITY;
        for (const glm::dvec3& q : *to) nearest = std::min(nearest, glm::distance(p, q));
        sum += nearest;
        largest = std::max(largest, nearest);
      }
    }
    EXPECT_EQ(distances.at(label).points, a.size() + b.size());
    EXPECT_NEAR(distances.at(label).mean, sum / static_cast<double>(a.size() + b.size()), 1e-9);
    EXPECT_NEAR(distances.at(label).largest, largest, 1e-9);
  }
}

TEST(SurfaceDistance, AMissingLabelHasNoPlaceAndTheGridsEndIsNoSurface) {
  const Geometry grid{.size = {9, 8, 7}, .spacing = {1, 1, 1}};
  Volume<std::uint8_t> first = empty(grid), second = first;
  fill(first, {0, 0, 0}, {9, 8, 7}, 3);
  const auto distances = surface_distances(view(first), view(second));
  EXPECT_EQ(distances.at(3).points + distances.at(3).missing, 0U) << "a label that fills the grid has no surface";
  fill(first, {4, 4, 4}, {6, 6, 6}, 5);
  const auto holes = surface_distances(view(first), view(second));
  EXPECT_EQ(holes.at(5).points, 0U);
  EXPECT_EQ(holes.at(5).missing, 8U);
}

TEST(SurfaceDistance, RefusesWhatDoesNotFit) {
  const Geometry grid{.size = {9, 8, 7}, .spacing = {1, 1, 1}};
  Geometry other = grid, tilted = grid;
  other.size.z = 6;
  tilted.direction[2] = glm::normalize(glm::dvec3(0, 0.3, 1));
  EXPECT_THROW(surface_distances(view(empty(grid)), view(empty(other))), InputError);
  const Volume<std::uint8_t> map = empty(tilted);
  EXPECT_THROW(surface_distances(view(map), view(map)), InputError);
  const Volume<float> numbers{grid, std::vector<float>(9 * 8 * 7)};
  EXPECT_THROW(surface_distances(view(numbers), view(numbers)), InputError);
}

}  // namespace
}  // namespace tetwarp::score
