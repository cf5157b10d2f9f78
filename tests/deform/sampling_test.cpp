// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>

#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Sampling);

const glm::dvec3 kShifts[] = {{0.5, 0, 0},
                              {0, -0.5, 0.5},
                              {0.25, 0.75, -0.25},
                              {-1.5, 0.5, 2.5},
                              {1229.0 / 4096, -3001.0 / 4096, 77.0 / 4096},
                              {0, 0, 4095.0 / 4096}};

TEST_P(Sampling, ValuesFollowTheFormulas) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({12, 9, 10});
  const auto resampler = make(grid);
  for (const glm::dvec3& shift : kShifts) {
    for (const Interpolation interpolation : kInterpolations) {
      SCOPED_TRACE("interpolation " + std::to_string(static_cast<int>(interpolation)));
      for (int type = 0; type < 8; ++type) {
        dispatch(static_cast<VoxelType>(type), [&](auto voxel) {
          using V = decltype(voxel);
          const bool is_signed = std::numeric_limits<V>::is_signed;
          const Options own{.interpolation = interpolation, .background = is_signed ? -7.0 : 9.0};
          const auto source = random_values<V>(grid, random, is_signed ? -100 : 50, 120);
          expect_like_formula(run_shifted(*resampler, source, shift, own), source, shift, own);
        });
      }
    }
  }
}

TEST_P(Sampling, LinearInterpolationGoesAlongXThenYThenZInFloat) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({9, 8, 7});
  const auto source = random_values<float>(grid, random, -1000, 3000);
  const glm::dvec3 shift(-1229.0 / 4096, -3001.0 / 4096, -77.0 / 4096);
  const auto found = run_shifted(*make(grid), source, shift, {});
  const glm::vec3 t(-shift);
  const auto at = [&](const glm::i64vec3& voxel) { return source.voxels[offset_of(grid, voxel)]; };
  const auto mix = [](float a, float b, float weight) { return a + weight * (b - a); };
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t n) {
    if (!is_voxel(grid, v + std::int64_t{1})) return;
    float along_z[2];
    for (int z = 0; z < 2; ++z) {
      float along_y[2];
      for (int y = 0; y < 2; ++y) along_y[y] = mix(at(v + glm::i64vec3(0, y, z)), at(v + glm::i64vec3(1, y, z)), t.x);
      along_z[z] = mix(along_y[0], along_y[1], t.y);
    }
    ASSERT_EQ(found.output.voxels[n], mix(along_z[0], along_z[1], t.z)) << to_string(v);
  });
}

TEST_P(Sampling, LargeIntegersKeepAllTheirBits) {
  const Geometry grid = unit_grid({8, 4, 4});
  Volume<std::int32_t> source{grid, {}};
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) {
    source.voxels.push_back(static_cast<std::int32_t>(1'000'000'001 + 4 * v.x));
  });
  const auto found = run_shifted(*make(grid), source, {-0.5, 0, 0}, {});
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t n) {
    if (v.x == 7) return;
    ASSERT_EQ(found.output.voxels[n], source.voxels[n] + 2);
  });
}

TEST_P(Sampling, HalvesRoundToEven) {
  const Geometry grid = unit_grid({12, 3, 3});
  Volume<std::int16_t> source{grid, {}};
  for_each_voxel(
      grid, [&](const glm::i64vec3& v, std::size_t) { source.voxels.push_back(static_cast<std::int16_t>(v.x - 6)); });
  const auto found = run_shifted(*make(grid), source, {-0.5, 0, 0}, {});
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t n) {
    const int low = static_cast<int>(v.x) - 6;
    if (v.x == 11) return;
    ASSERT_EQ(found.output.voxels[n], low % 2 == 0 ? low : low + 1);
  });
}

TEST_P(Sampling, CubicOvershootSaturatesAndIsCounted) {
  const Geometry grid = unit_grid({12, 6, 6});
  Volume<std::uint8_t> source{grid, {}};
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) { source.voxels.push_back(v.x < 6 ? 0 : 255); });
  const Options options{.interpolation = Interpolation::cubic, .background = 0};
  const auto found = run_shifted(*make(grid), source, {0.5, 0, 0}, options);
  expect_like_formula(found, source, {0.5, 0, 0}, options);
  EXPECT_EQ(found.report.clamped, 2u * 36u);  // -16 before the step, 271 after it
}

TEST_P(Sampling, BackgroundIsRoundedAndSaturated) {
  const Geometry grid = unit_grid({4, 4, 4});
  const Volume<std::uint8_t> source{grid, std::vector<std::uint8_t>(64, 100)};
  const auto resampler = make(grid);
  const std::pair<double, int> cases[] = {{2.5, 2}, {3.5, 4}, {300, 255}, {-5, 0}, {7, 7}};
  for (const auto& [background, expected] : cases) {
    const auto found = run_shifted(*resampler, source, {100, 0, 0}, {.background = background});
    EXPECT_EQ(found.report.uncovered, 64u);
    EXPECT_TRUE(same_bits(std::vector<std::uint8_t>(64, static_cast<std::uint8_t>(expected)), found.output.voxels));
  }
}

TEST_P(Sampling, PlacesUpToHalfAVoxelOutsideAreClampedAndFurtherOutAreBackground) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({5, 6, 7});
  const auto resampler = make(grid);
  const auto source = random_values<float>(grid, random, 0, 100);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double direction : {-1.0, 1.0}) {
      for (const double beyond : {0.0, 1.0 / 4096}) {
        glm::dvec3 shift(0);
        shift[axis] = direction * (0.5 + beyond);
        const std::int64_t border = direction > 0 ? 0 : grid.size[axis] - 1;
        for (const Interpolation interpolation : kInterpolations) {
          const Options options{.interpolation = interpolation};
          const auto found = run_shifted(*resampler, source, shift, options);
          expect_like_formula(found, source, shift, options);
          for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
            if (voxel[axis] != border) return;
            ASSERT_EQ(found.coverage.voxels[n], beyond == 0);
            ASSERT_EQ(found.owners.voxels[n], 1);
            ASSERT_EQ(found.output.voxels[n], beyond == 0 ? source.voxels[n] : -7);
          });
        }
      }
    }
  }
}

TEST_P(Sampling, NotANumberStaysInVoxelsThatHaveWeight) {
  const Geometry grid = unit_grid({8, 7, 6});
  const auto resampler = make(grid);
  for (const float odd : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Volume<float> source{grid, {}};
    for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) { source.voxels.push_back(v.x == 4 ? odd : 10.0f); });
    for (const Interpolation interpolation : kInterpolations) {
      const auto found = run_shifted(*resampler, source, {1, 0.5, -0.25}, {.interpolation = interpolation});
      for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t n) {
        if (!found.coverage.voxels[n]) return;
        if (v.x == 5) {
          ASSERT_FALSE(std::isfinite(found.output.voxels[n])) << to_string(v);
        } else {
          ASSERT_NEAR(found.output.voxels[n], 10.0f, 1e-4f) << to_string(v);
        }
      });
    }
  }
}

TEST_P(Sampling, SlicesThatWereReadAreNoted) {
  const Geometry grid = unit_grid({6, 6, 8});
  Random random(3);
  const auto source = random_values<std::int16_t>(grid, random, 0, 100);
  const auto resampler = make(grid);
  const VertexField field = uniform_field(wide_lattice(grid), {0, 0, 2.25f});
  resampler->set_field(view(field));
  for (const Interpolation interpolation : kInterpolations) {
    Outcome<std::int16_t> outcome = poisoned_outcome<std::int16_t>(grid);
    std::vector<SliceRange> slices(8);
    const Target target{.source = view(source),
                        .output = view(outcome.output),
                        .interpolation = interpolation,
                        .sampled_slices = slices};
    resampler->resample(whole(grid), {&target, 1});
    EXPECT_GT(slices[0].first, slices[0].last);
    EXPECT_GT(slices[1].first, slices[1].last);
    for (std::int64_t k = 4; k < 7; ++k) {  // from k - 2.25
      const SliceRange& range = slices[static_cast<std::size_t>(k)];
      const std::int64_t more = interpolation == Interpolation::cubic ? 1 : 0;
      EXPECT_EQ(range.first, interpolation == Interpolation::nearest ? k - 2 : std::max<std::int64_t>(k - 3 - more, 0));
      EXPECT_EQ(range.last, k - 2 + more);
    }
  }
}

TEST_P(Sampling, SourcesOnAnotherGridAreReachedByOneAffineMap) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = oblique_grid({14, 12, 10});
  Geometry other = unit_grid({11, 13, 9});
  other.spacing = {1.1, 0.9, 1.7};
  other.direction = rotation({-1, 0.3, 2}, 1.1);
  other.direction[1] += 0.2 * other.direction[2];  // sheared, as a tilted gantry gives
  other.origin = centre(grid) - other.direction * (other.spacing * glm::dvec3(5, 6, 4));
  const AffineMap index = index_from_point(other) * point_from_index(grid);
  const auto source = random_values<float>(other, random, -100, 100);
  const auto resampler = make(grid);
  const VertexField field =
      field_in_voxels(grid, lattice_over(grid, 3), [](const glm::dvec3&) { return glm::dvec3(0.375); });
  resampler->set_field(view(field));
  for (const Interpolation interpolation : kInterpolations) {
    const auto found = run(*resampler, source, {.interpolation = interpolation});
    int inside = 0;
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (found.owners.voxels[n] == 0) return;
      const auto expected = reference_sample(source, index(glm::dvec3(voxel) - 0.375), interpolation);
      if (expected.jump < 1e-4) return;
      ASSERT_EQ(found.coverage.voxels[n], expected.inside);
      ASSERT_NEAR(found.output.voxels[n], expected.inside ? expected.value : -7, 1e-3) << to_string(voxel);
      inside += expected.inside;
    });
    EXPECT_GT(inside, 200);
  }
}

}  // namespace
}  // namespace tetwarp
