// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A pull field as a forward one, continued until its image holds a volume.
#include "deform/fields/continued.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deform/errors.h"
#include "deform/resampler.h"
#include "tests/support/run.h"

namespace tetwarp {
namespace {

Geometry box(const glm::i64vec3& size, const glm::dvec3& spacing, const glm::dvec3& origin) {
  Geometry grid;
  grid.size = size;
  grid.spacing = spacing;
  grid.origin = origin;
  return grid;
}

/// A turned grid whose samples move unlike one another, up to 20 mm, at the borders too.
PullField wild() {
  PullField field{box({7, 6, 5}, {5, 6, 7}, {-12, 4, -9}), {}};
  field.grid.direction = glm::dmat3(0, 1, 0, -0.6, 0, 0.8, 0.8, 0, 0.6);
  for (int n = 0; n < 7 * 6 * 5; ++n)
    field.displacement.emplace_back(12 * std::sin(n * 0.3), 10 * std::cos(n * 0.2), 8 * std::sin(n * 0.7 + 1));
  return field;
}

TEST(Continued, EveryVoxelOfTheTargetHasAPlace) {
  const PullField field = wild();
  for (const Geometry& target :
       {box({20, 18, 16}, {3, 3, 3}, {-40, -10, -20}), box({9, 9, 9}, {2, 2, 2}, {60, 40, 30})}) {
    const VertexField forward = continued_over(field, target);
    const auto resampler = make_cpu_resampler(target);
    resampler->set_field(view(forward, Outside::background));
    PullField inverse{target, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(target)))};
    const Report report = resampler->resample(whole(target), {}, {.coverage = {}, .inverse_mm = samples_of(inverse)});
    EXPECT_EQ(report.uncovered, 0U);
    EXPECT_GT(report.covered, 0U);
  }
}

TEST(Continued, SamplesStayWhereTheyAreAndGoOnBeyond) {
  const PullField field = wild();
  const VertexField forward = continued_over(field, box({20, 18, 16}, {3, 3, 3}, {-40, -10, -20}));
  const AffineMap index = index_from_point(field.grid), point = point_from_index(forward.lattice);
  std::size_t within = 0;
  test::for_each_voxel(forward.lattice, [&](const glm::i64vec3& vertex, std::size_t n) {
    const glm::dvec3 at = glm::round(index(point(glm::dvec3(vertex))));
    const glm::i64vec3 nearest = glm::clamp(glm::i64vec3(at), glm::i64vec3(0), field.grid.size - std::int64_t{1});
    within += nearest == glm::i64vec3(at);
    ASSERT_EQ(forward.displacement[n], field.displacement[test::offset_of(field.grid, nearest)]) << n;
  });
  EXPECT_EQ(within, 7U * 6 * 5);
}

TEST(Continued, GapsAndFarVolumesAreRefused) {
  PullField field = wild();
  EXPECT_THROW(continued_over(field, box({9, 9, 9}, {2, 2, 2}, {1e6, 0, 0})), InputError);
  EXPECT_THROW(continued_over(field, box({9, 9, 9}, {2, 2, 2}, {1e300, 0, 0})), InputError);
  field.displacement[8].y = NAN;
  try {
    continued_over(field, box({9, 9, 9}, {2, 2, 2}, {0, 0, 0}));
    ADD_FAILURE() << "a gap was taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("at sample (1, 1, 0)"), std::string::npos) << error.what();
  }
  field = wild();
  field.displacement.pop_back();
  EXPECT_THROW(continued_over(field, box({9, 9, 9}, {2, 2, 2}, {0, 0, 0})), InputError);
}

}  // namespace
}  // namespace tetwarp
