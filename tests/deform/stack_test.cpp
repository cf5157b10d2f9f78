// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Sources whose slices do not stand straight or evenly: gantry tilt, uneven slice distances.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/reference_sample.h"
#include "tests/support/run.h"
#include "tests/support/says.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Stacks);

/// Columns lean by 18.5 degrees against the stack, as in a tilted head CT.
Geometry tilted_grid() {
  const double c = std::cos(18.5 * M_PI / 180), s = std::sin(18.5 * M_PI / 180);
  return {{14, 12, 9}, {0.5, 0.5, 2.5}, {-123.5, -15.75, 742.375}, glm::dmat3(1, 0, 0, 0, c, -s, 0, 0, 1)};
}

/// Places of slices: two distances and a narrow gap between, as one scanner wrote them.
Geometry uneven(Geometry grid) {
  grid.slices = {0, 4.25, 8.5, 12.75, 14, 21.25, 28.5, 35.75, 43};
  grid.spacing.z = grid.slices.back() / 8;
  return grid;
}

std::vector<Geometry> grids() {
  Geometry straight = tilted_grid();
  straight.direction = rotation({1, 2, -3}, 0.7);
  return {tilted_grid(), uneven(straight), uneven(tilted_grid())};
}

/// Continuous index by looking through the slices one by one. Beyond the outermost ones: as between the last two.
glm::dvec3 index_in(const Geometry& grid, const glm::dvec3& point) {
  glm::dvec3 index = index_from_point(grid)(point);
  if (grid.slices.empty()) return index;
  const double mm = index.z * grid.spacing.z;
  std::size_t k = 0;
  while (k + 2 < grid.slices.size() && mm >= grid.slices[k + 1]) ++k;
  index.z = static_cast<double>(k) + (mm - grid.slices[k]) / (grid.slices[k + 1] - grid.slices[k]);
  return index;
}

Volume<float> noise_on(const Geometry& grid) {
  std::mt19937 random(5);
  Volume<float> volume{grid, {}};
  for (std::int64_t n = 0; n < voxel_count(grid); ++n)
    volume.voxels.push_back(static_cast<float>(random() % 1000) / 10);
  return volume;
}

/// The text of the InputError that a call throws; empty when it throws none.
template <class Call>
std::string error_of(Call&& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

VertexField identity_over(const Geometry& grid) { return uniform_field(lattice_over(grid, 3), glm::vec3(0)); }

TEST_P(Stacks, AreSampledWhereTheirSlicesLie) {
  for (const Geometry& grid : grids()) {
    const Volume<float> source = noise_on(grid);
    const Geometry output = straightened(grid);
    const auto resampler = make(output);
    const VertexField field = identity_over(output);
    resampler->set_field(view(field));
    for (const Interpolation interpolation : {Interpolation::linear, Interpolation::nearest, Interpolation::vote}) {
      Volume<float> found = poisoned<float>(output);
      const Target target{
          .source = view(source), .output = view(found), .interpolation = interpolation, .background = -700};
      resampler->resample(whole(output), {&target, 1});
      std::uint64_t inside = 0;
      for_each_voxel(output, [&](const glm::i64vec3& voxel, std::size_t n) {
        const ReferenceSample expected =
            reference_sample(source, index_in(grid, point_from_index(output)(glm::dvec3(voxel))), interpolation);
        if (expected.jump < 1e-9) return;
        ASSERT_NEAR(found.voxels[n], expected.inside ? expected.value : -700, 1e-3) << to_string(voxel);
        inside += expected.inside;
      });
      EXPECT_GT(inside, static_cast<std::uint64_t>(voxel_count(output) / 4));
    }
  }
}

TEST_P(Stacks, AFieldMovesThemAsItMovesAStraightSource) {
  const Geometry grid = uneven(tilted_grid()), output = straightened(grid);
  const glm::vec3 shift(1.5F, -0.75F, 2.25F);
  const Volume<float> source = noise_on(grid);
  const auto resampler = make(output);
  const VertexField field = uniform_field(lattice_over(output, 3), shift);
  resampler->set_field(view(field));
  Volume<float> found = poisoned<float>(output);
  const Target target{.source = view(source), .output = view(found), .background = -700};
  resampler->resample(whole(output), {&target, 1});
  std::uint64_t inside = 0;
  for_each_voxel(output, [&](const glm::i64vec3& voxel, std::size_t n) {
    const glm::dvec3 rest = point_from_index(output)(glm::dvec3(voxel)) - glm::dvec3(shift);
    const glm::dvec3 in_lattice = index_from_point(output)(rest);
    const glm::dvec3 room = glm::min(in_lattice, glm::dvec3(output.size - std::int64_t{1}) - in_lattice);
    if (std::min({room.x, room.y, room.z}) < 0.01) return;  // nothing comes from there, or from cells that overhang
    const ReferenceSample expected = reference_sample(source, index_in(grid, rest), Interpolation::linear);
    if (expected.jump < 1e-3) return;
    ASSERT_NEAR(found.voxels[n], expected.inside ? expected.value : -700, 0.2) << to_string(voxel);
    inside += expected.inside;
  });
  EXPECT_GT(inside, 300U);
}

TEST_P(Stacks, RegionsFromPartsOfTheSourceGiveTheSameBits) {
  for (const Geometry& grid : grids()) {
    const Volume<float> source = noise_on(grid);
    const Geometry output = straightened(grid);
    const auto resampler = make(output);
    const VertexField field = uniform_field(lattice_over(output, 1), glm::vec3(0));
    resampler->set_field(view(field));
    Volume<float> at_once = poisoned<float>(output), in_parts = poisoned<float>(output);
    const Target all{.source = view(source), .output = view(at_once), .background = -700};
    resampler->resample(whole(output), {&all, 1});
    for (std::int64_t z = 0; z < output.size.z; z += 2) {
      Region region = whole(output);
      region.begin.z = z;
      region.end.z = std::min(z + 2, output.size.z);
      const Region needed = resampler->source_region(grid, region);
      std::vector<float> part;
      for (std::int64_t k = needed.begin.z; k < needed.end.z; ++k)
        for (std::int64_t j = needed.begin.y; j < needed.end.y; ++j)
          for (std::int64_t i = needed.begin.x; i < needed.end.x; ++i)
            part.push_back(source.voxels[static_cast<std::size_t>((k * grid.size.y + j) * grid.size.x + i)]);
      Target target = all;
      target.source.buffered = needed;
      target.source.voxels = std::as_bytes(std::span(part)).data();
      target.output = view(in_parts);
      if (output.size.z > 24 && z == 0) {  // several blocks of vertices
        EXPECT_LT(voxel_count(needed), voxel_count(grid));
      }
      resampler->resample(region, {&target, 1});
    }
    EXPECT_EQ(in_parts.voxels, at_once.voxels);
  }
}

TEST_P(Stacks, CubicNeedsEvenSlices) {
  const Geometry grid = uneven(tilted_grid()), output = straightened(grid);
  const Volume<float> source = noise_on(grid);
  const auto resampler = make(output);
  const VertexField field = identity_over(output);
  resampler->set_field(view(field));
  Volume<float> found = poisoned<float>(output);
  const Target target{.source = view(source), .output = view(found), .interpolation = Interpolation::cubic};
  EXPECT_TRUE(says(error_of([&] { resampler->resample(whole(output), {&target, 1}); }), {"cubic", "even slices"}));
  EXPECT_TRUE(says(error_of([&] { make(grid); }), {"output grid", "uneven slices"}));
}

TEST(StraightenedGrid, HoldsAllSlicesWithRowsAndColumnsAsTheyAre) {
  for (const Geometry& grid : grids()) {
    const Geometry straight = straightened(grid);
    EXPECT_FALSE(is_sheared(straight));
    EXPECT_TRUE(straight.slices.empty());
    EXPECT_EQ(straight.direction[0], grid.direction[0]);
    EXPECT_NEAR(glm::dot(straight.direction[1], grid.direction[1]), 1, 1e-12);
    EXPECT_EQ(straight.spacing.x, grid.spacing.x);
    EXPECT_EQ(straight.spacing.y, grid.spacing.y);
    const double lean = glm::dot(straight.direction[2], grid.direction[2]);
    EXPECT_NEAR(straight.spacing.z, (grid.slices.empty() ? 2.5 : 1.25) * lean, 1e-12);
    const AffineMap index = index_from_point(straight) * point_from_index(grid);
    glm::dvec3 low(INFINITY), high(-INFINITY);
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 at = index(glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(13, 11, 8));
      low = glm::min(low, at);
      high = glm::max(high, at);
    }
    for (int axis = 0; axis < 3; ++axis) {  // inside, and no whole voxel to spare
      EXPECT_GE(low[axis], -0.001);
      EXPECT_LT(low[axis], 1);
      EXPECT_LE(high[axis], static_cast<double>(straight.size[axis]) - 1 + 0.001);
      EXPECT_GT(high[axis], static_cast<double>(straight.size[axis]) - 2);
    }
  }
}

TEST(StraightenedGrid, OfAStraightVolumeIsItsOwn) {
  const Geometry grid = oblique_grid({5, 6, 7});
  EXPECT_EQ(straightened(grid), grid);
}

TEST(Geometry, SpacingsBeyondAllMeasureAreRefused) {
  for (const double spacing : {1e-6, 0.7, 1e6}) require_valid(Geometry{{4, 4, 4}, {1, spacing, 1}}, "grid");
  for (const double spacing : {0.0, -1.0, 1e-9, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    const Geometry bad{{4, 4, 4}, {1, spacing, 1}};
    EXPECT_TRUE(says(error_of([&] { require_valid(bad, "grid"); }), {"grid: spacing", "axis 1", "from 1e-6 to 1e6"}));
  }
}

TEST(StraightenedGrid, PlacesOfSlicesAreChecked) {
  const Geometry good = uneven(tilted_grid());
  require_valid(good, "grid");
  Geometry bad = good;
  bad.slices[3] = bad.slices[2];
  EXPECT_TRUE(says(error_of([&] { require_valid(bad, "grid"); }), {"grid: slice 3", "rising"}));
  bad = good;
  bad.slices.pop_back();
  EXPECT_TRUE(says(error_of([&] { require_valid(bad, "grid"); }), {"8 places", "each of 9"}));
  bad = good;
  bad.spacing.z = 5;
  EXPECT_TRUE(says(error_of([&] { require_valid(bad, "grid"); }), {"mean distance"}));
}

}  // namespace
}  // namespace tetwarp
