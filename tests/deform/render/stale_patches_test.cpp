// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/stale_patches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using test::oblique_grid;
using test::Random;
using test::seed_text;
using test::test_seed;
using test::unit_grid;

constexpr int kWidth = 8, kHeight = 4;  ///< pixels of a patch

/// How far the ray of a pixel passes from a box of voxels: the largest of its three distances along i, j and k where
/// that is least, in steps of a tenth of a voxel along the ray.
double distance_to(const Region& region, const Geometry& grid, const ViewPlane& plane, int x, int y) {
  const AffineMap index = index_from_point(grid);
  const glm::dvec3 low(region.begin), high(region.end - std::int64_t{1}), middle = 0.5 * (low + high);
  const glm::dvec3 from = index(plane.at(x + 0.5, y + 0.5)), along = index.linear * plane.forward;
  // Around the point of the ray that is next to the middle of the box.
  const double next = glm::dot(middle - from, along) / glm::dot(along, along),
               reach = (glm::length(high - low) + 8) / glm::length(along), step = 0.1 / glm::length(along);
  double least = 1e9;
  for (double t = next - reach; t <= next + reach; t += step) {
    const glm::dvec3 apart = glm::max(low - (from + along * t), (from + along * t) - high);
    least = std::min(least, std::max({apart.x, apart.y, apart.z, 0.0}));
  }
  return least;
}

TEST(StalePatches, HoldThePixelsWhoseRaysComeNearAChange) {
  SCOPED_TRACE(seed_text(test_seed()));
  int near = 0, patches = 0, all = 0;
  for (std::uint64_t n = 0; n < test::test_cases(60); ++n) {
    SCOPED_TRACE("case " + std::to_string(n));
    Random random(test_seed(), 8500 + n);
    const Geometry grid = oblique_grid({60, 50, 40});
    const ViewPlane plane = view_plane({.angle_deg = random.real(0, 360),
                                        .elevation_deg = random.real(-90, 90),
                                        .zoom = random.real(0.5, 3),
                                        .width = static_cast<int>(random.integer(1, 100)),
                                        .height = static_cast<int>(random.integer(1, 100))},
                                       grid);
    StalePatches stale(kWidth, kHeight);
    stale.change(grid, {});
    stale.keep(plane);
    Region region;
    for (int axis = 0; axis < 3; ++axis) {
      region.begin[axis] = random.integer(0, grid.size[axis] - 1);
      region.end[axis] = std::min(region.begin[axis] + random.integer(1, 6), grid.size[axis]);
    }
    stale.change(grid, {&region, 1});
    const std::optional<std::vector<int>> found = stale.take(plane);
    ASSERT_TRUE(found);
    EXPECT_TRUE(std::is_sorted(found->begin(), found->end()));
    const int columns = (plane.width + kWidth - 1) / kWidth, rows = (plane.height + kHeight - 1) / kHeight;
    for (int y = 0; y < plane.height; ++y) {
      for (int x = 0; x < plane.width; ++x) {
        if (distance_to(region, grid, plane, x, y) >= 2) continue;
        ++near;
        ASSERT_TRUE(std::binary_search(found->begin(), found->end(), y / kHeight * columns + x / kWidth))
            << x << ", " << y;
      }
    }
    patches += static_cast<int>(found->size());
    all += columns * rows;
  }
  EXPECT_GT(near, 100);
  EXPECT_LT(patches, all / 4);
}

TEST(StalePatches, AddUpUntilAPictureIsDrawn) {
  const Geometry grid = unit_grid({64, 64, 64});
  const ViewPlane plane = view_plane({.width = 64, .height = 64}, grid);
  StalePatches stale(kWidth, kHeight);
  EXPECT_FALSE(stale.is_worth_keeping());
  EXPECT_FALSE(stale.take(plane));
  stale.change(grid, {});
  EXPECT_TRUE(stale.is_worth_keeping());
  EXPECT_FALSE(stale.take(plane)) << "no picture was kept";
  stale.keep(plane);
  EXPECT_EQ(stale.take(plane), std::vector<int>()) << "nothing has changed";
  EXPECT_FALSE(stale.take(plane)) << "no picture is kept any more";

  const Region left{{0, 30, 30}, {4, 34, 34}}, right{{60, 30, 30}, {64, 34, 34}}, nothing{{9, 9, 9}, {9, 9, 9}};
  const auto after = [&](const std::vector<std::vector<Region>>& changes) {
    stale.keep(plane);
    for (const std::vector<Region>& change : changes) stale.change(grid, change);
    return stale.take(plane).value();
  };
  const std::vector<int> of_left = after({{left}}), of_right = after({{right}});
  std::vector<int> both;
  std::set_union(of_left.begin(), of_left.end(), of_right.begin(), of_right.end(), std::back_inserter(both));
  EXPECT_FALSE(of_left.empty());
  EXPECT_FALSE(of_right.empty());
  EXPECT_EQ(both.size(), of_left.size() + of_right.size());
  EXPECT_EQ(after({{left, right}}), both);
  EXPECT_EQ(after({{left}, {nothing, left}, {}, {right}}), both);

  stale.keep(plane);
  ViewPlane nearer = plane;
  nearer.pixel_mm *= 0.5;
  EXPECT_FALSE(stale.take(nearer)) << "the picture of another plane is kept";
  stale.keep(plane);
  stale.forget();
  EXPECT_FALSE(stale.is_worth_keeping());
  EXPECT_FALSE(stale.take(plane));
}

}  // namespace
}  // namespace tetwarp
