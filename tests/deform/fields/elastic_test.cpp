// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/elastic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "deform/fields/formula.h"
#include "tests/support/fields.h"
#include "tests/support/random.h"

namespace tetwarp {
namespace {

using namespace test;

/// The cubic B-spline, support (-2, 2), by its recursion.
double b_spline(double t, int degree = 3) {
  const double half = 0.5 * (degree + 1);
  if (degree == 0) return t >= -0.5 && t < 0.5 ? 1 : 0;
  return ((half + t) * b_spline(t + 0.5, degree - 1) + (half - t) * b_spline(t - 0.5, degree - 1)) / degree;
}

TEST(Elastic, IsTheSumOfRandomSplinesThatItsDefinitionNames) {
  const Elastic field{.amplitude = 5, .spacing = 32, .seed = 7, .centre = {10, -20, 30}};
  for (const glm::dvec3 point : {glm::dvec3(0, 0, 0), glm::dvec3(-173.25, 88.5, 411), field.centre}) {
    const glm::dvec3 t = (point - field.centre) / 32.0;
    glm::dvec3 sum(0);
    for (int k = -20; k < 20; ++k) {
      for (int j = -20; j < 20; ++j) {
        for (int i = -20; i < 20; ++i)
          sum += b_spline(t.x - i) * b_spline(t.y - j) * b_spline(t.z - k) * random_control(7, {i, j, k});
      }
    }
    EXPECT_LE(glm::length(field(point) - 5.0 * sum), 1e-12);
  }
}

TEST(Elastic, RandomNumbersFillTheirRangeEvenlyAndDoNotDependOnEachOther) {
  constexpr int kSide = 24;
  glm::dvec3 mean(0), square(0), with_next(0), across(0);
  double least = 1, most = -1;
  for (int k = 0; k < kSide; ++k) {
    for (int j = 0; j < kSide; ++j) {
      for (int i = 0; i < kSide; ++i) {
        const glm::dvec3 r = random_control(3, {i - kSide / 2, j, k});
        mean += r;
        square += r * r;
        with_next += r * random_control(3, {i - kSide / 2 + 1, j, k});
        across += r * glm::dvec3(r.y, r.z, r.x);
        least = std::min({least, r.x, r.y, r.z});
        most = std::max({most, r.x, r.y, r.z});
      }
    }
  }
  const double count = kSide * kSide * kSide, five_sigma = 5 / std::sqrt(count);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(mean[axis] / count, 0, five_sigma * std::sqrt(1.0 / 3));
    EXPECT_NEAR(square[axis] / count, 1.0 / 3, five_sigma * std::sqrt(4.0 / 45));
    EXPECT_NEAR(with_next[axis] / count, 0, five_sigma / 3);
    EXPECT_NEAR(across[axis] / count, 0, five_sigma / 3);
  }
  EXPECT_GT(least, -1);
  EXPECT_LT(least, -0.99);
  EXPECT_LT(most, 1);
  EXPECT_GT(most, 0.99);
  EXPECT_NE(random_control(3, {1, 2, 3}), random_control(4, {1, 2, 3}));
  EXPECT_NE(random_control(3, {1, 2, 3}), random_control(3, {2, 1, 3}));
}

TEST(Elastic, StaysWithinItsAmplitudeAndHasTheSpreadThatIsSaid) {
  const Elastic field{.amplitude = 10, .spacing = 40, .seed = 1};
  Random random(5);
  glm::dvec3 square(0);
  constexpr int kPoints = 20000;
  for (int n = 0; n < kPoints; ++n) {
    const glm::dvec3 by = field({random.real(-2000, 2000), random.real(-2000, 2000), random.real(-2000, 2000)});
    for (int axis = 0; axis < 3; ++axis) ASSERT_LT(std::abs(by[axis]), 10);
    square += by * by;
  }
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(std::sqrt(square[axis] / kPoints), 1.9, 0.1);
}

TEST(Elastic, DoesNotFoldBelowItsLimit) {
  Random random(6);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Elastic field{.amplitude = 40 / 2.48, .spacing = 40, .seed = seed};
    for (int n = 0; n < 500; ++n) {
      const glm::dvec3 at(random.real(-900, 900), random.real(-900, 900), random.real(-900, 900));
      constexpr double kStep = 1e-3;
      glm::dmat3 jacobian(1);
      for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 step(0);
        step[axis] = kStep;
        jacobian[axis] += (field(at + step) - field(at - step)) / (2 * kStep);
      }
      ASSERT_GT(glm::determinant(jacobian), 0) << "seed " << seed;
    }
  }
}

TEST(Elastic, OfTheCommandLineIsCentredOnTheVolume) {
  Geometry grid = unit_grid({65, 49, 33});
  grid.spacing = {2, 3, 5};
  grid.origin = {7, 8, 9};
  const Elastic expected{.amplitude = 4, .spacing = 32, .seed = 18446744073709551615U, .centre = centre(grid)};
  const glm::dvec3 point(40, 50, 60);
  EXPECT_EQ(parse_formula("elastic:amplitude=2vox,spacing=16vox,seed=18446744073709551615", grid)(point),
            expected(point));
  for (const char* wrong : {"elastic:amplitude=4,spacing=32", "elastic:amplitude=4,spacing=0,seed=1",
                            "elastic:amplitude=4,spacing=32,seed=-1", "elastic:amplitude=4,spacing=32,seed=1.5",
                            "elastic:amplitude=4,spacing=1e-6,seed=1", "elastic:spacing=32,seed=1"})
    EXPECT_THROW(parse_formula(wrong, grid), InputError) << wrong;
}

}  // namespace
}  // namespace tetwarp
