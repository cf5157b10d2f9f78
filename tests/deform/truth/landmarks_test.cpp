// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "tests/support/fields.h"

namespace tetwarp::truth {
namespace {

/// Air with a block of tissue from (12, 10, 9) to (27, 22, 19).
Volume<std::int16_t> block() {
  const Geometry grid{.size = {40, 36, 30}, .spacing = {1.5, 2, 2.5}, .origin = {-20, 5, 7}};
  Volume<std::int16_t> volume{grid, std::vector<std::int16_t>(static_cast<std::size_t>(voxel_count(grid)), -1000)};
  for (std::int64_t k = 9; k < 20; ++k)
    for (std::int64_t j = 10; j < 23; ++j)
      for (std::int64_t i = 12; i < 28; ++i) volume.voxels[static_cast<std::size_t>(i + 40 * (j + 36 * k))] = 50;
  return volume;
}

TEST(Landmarks, CornersOfABlockAreFound) {
  const Volume<std::int16_t> volume = block();
  const std::vector<std::uint8_t> everywhere(volume.voxels.size(), 1);
  const std::vector<glm::dvec3> found = find_landmarks(view(volume), everywhere, {.most = 8, .apart_mm = 10});
  ASSERT_EQ(found.size(), 8U);
  const AffineMap point = point_from_index(volume.geometry);
  for (const double i : {12, 27}) {
    for (const double j : {10, 22}) {
      for (const double k : {9, 19}) {
        const glm::dvec3 corner = point({i, j, k});
        double nearest = 1e9;
        for (const glm::dvec3& place : found) nearest = std::min(nearest, glm::distance(place, corner));
        EXPECT_LT(nearest, 7) << i << " " << j << " " << k;
      }
    }
  }
}

TEST(Landmarks, AreApartInsideTheBodyAndTheSameForAnyNumberOfThreads) {
  Volume<std::int16_t> volume = block();
  test::Random random(5);
  for (std::int16_t& hu : volume.voxels) hu = static_cast<std::int16_t>(hu + random.integer(0, 200));
  std::vector<std::uint8_t> body(volume.voxels.size());
  for (std::size_t n = 0; n < body.size(); ++n) body[n] = n % 40 > 20;
  const std::vector<glm::dvec3> found = find_landmarks(view(volume), body, {.most = 100, .apart_mm = 6});
  ASSERT_GT(found.size(), 30U);
  const AffineMap index = index_from_point(volume.geometry);
  for (std::size_t n = 0; n < found.size(); ++n) {
    EXPECT_GT(index(found[n]).x, 20);
    for (std::size_t m = 0; m < n; ++m) EXPECT_GE(glm::distance(found[n], found[m]), 6);
  }
  EXPECT_EQ(find_landmarks(view(volume), body, {.most = 100, .apart_mm = 6}, {.threads = 1}), found);
}

TEST(Landmarks, EdgesAndPlanesAreNone) {
  Volume<std::int16_t> volume = block();
  for (std::size_t n = 0; n < volume.voxels.size(); ++n) volume.voxels[n] = n % 40 < 20 ? -1000 : 50;
  EXPECT_TRUE(find_landmarks(view(volume), std::vector<std::uint8_t>(volume.voxels.size(), 1)).empty());
  EXPECT_THROW(find_landmarks(view(volume), {}), InputError);
}

}  // namespace
}  // namespace tetwarp::truth
