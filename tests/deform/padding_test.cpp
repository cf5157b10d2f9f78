// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "tests/support/backends.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(PaddingRule);

/// Tissue from 0 to 1000 with padding, -2000 to -1990, strewn in and all over one end.
Volume<std::int16_t> padded_source(const Geometry& grid, Random& random) {
  auto source = random_values<std::int16_t>(grid, random, 0, 1000);
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    if (voxel.x < 3 || random.chance(0.05)) source.voxels[n] = static_cast<std::int16_t>(random.integer(-2000, -1990));
  });
  return source;
}

constexpr PaddingRange kPadding{-2000, -1990};

TEST_P(PaddingRule, SamplesThatTouchPaddingTakeTheHeaviestVoxelAndAreCounted) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({13, 9, 8});
  const auto resampler = make(grid);
  const glm::dvec3 shifts[] = {{0.5, 0, 0},  {0.5, 0.5, -0.5}, {-0.25, 0.75, 0.5},
                               {0, 0.25, 0}, {1, -2, 0},       {0.75, 0.75, 0.75}};
  for (const glm::dvec3& shift : shifts) {
    for (const Interpolation interpolation : kInterpolations) {
      SCOPED_TRACE("interpolation " + std::to_string(static_cast<int>(interpolation)));
      const auto source = padded_source(grid, random);
      const Options options{.interpolation = interpolation, .padding = kPadding};
      const auto found = run_shifted(*resampler, source, shift, options);
      expect_like_formula(found, source, shift, options);
      EXPECT_GT(found.report.padded, 100u);
    }
  }
}

TEST_P(PaddingRule, PaddingNeverBleedsIntoTissue) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({13, 9, 8});
  const auto resampler = make(grid);
  const auto source = padded_source(grid, random);
  const VertexField field = field_in_voxels(grid, lattice_over(grid, 2), [&](const glm::dvec3&) {
    return glm::dvec3(random.real(-0.6, 0.6), random.real(-0.6, 0.6), random.real(-0.6, 0.6));
  });
  resampler->set_field(view(field));
  const auto found = run(*resampler, source, {.background = -2000, .padding = kPadding});
  std::uint64_t mixed = 0;
  for (const std::int16_t voxel : found.output.voxels) mixed += voxel < 0 && (voxel < -2000 || voxel > -1990);
  EXPECT_EQ(mixed, 0u);
  const auto without = run(*resampler, source, {.background = -2000});
  for (const std::int16_t voxel : without.output.voxels) mixed += voxel < 0 && (voxel < -2000 || voxel > -1990);
  EXPECT_GT(mixed, 50u) << "this source and field would not show bleeding";
  EXPECT_EQ(without.report.padded, 0u);
}

TEST_P(PaddingRule, IdentityKeepsPaddingAndTissueAsTheyAre) {
  Random random(11);
  const Geometry grid = oblique_grid({13, 9, 8});
  const auto source = padded_source(grid, random);
  std::uint64_t padding = 0;
  for (const std::int16_t voxel : source.voxels) padding += voxel < 0;
  const auto resampler = make(grid);
  const VertexField field = uniform_field(lattice_over(grid, 4), glm::vec3(0));
  resampler->set_field(view(field));
  for (const Interpolation interpolation : kInterpolations) {
    const auto found = run(*resampler, source, {.interpolation = interpolation, .padding = kPadding});
    EXPECT_TRUE(same_bits(source.voxels, found.output.voxels));
    EXPECT_EQ(found.report.padded, padding);
  }
}

TEST_P(PaddingRule, RangesThatTheVoxelTypeCannotHoldAreNoPadding) {
  Random random(12);
  const Geometry grid = unit_grid({7, 6, 5});
  const auto source = random_values<std::uint8_t>(grid, random, 0, 255);
  const auto resampler = make(grid);
  const glm::dvec3 shift(0.5, 0.25, 0);
  for (const PaddingRange range :
       {PaddingRange{-2000, -1}, PaddingRange{256, 4000}, PaddingRange{9, 3}, PaddingRange{10.2, 10.8}}) {
    const Options options{.background = 0, .padding = range};
    const auto found = run_shifted(*resampler, source, shift, options);
    EXPECT_EQ(found.report.padded, 0u);
    EXPECT_TRUE(
        same_bits(run_shifted(*resampler, source, shift, {.background = 0}).output.voxels, found.output.voxels));
  }
}

}  // namespace
}  // namespace tetwarp
