// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/sincos.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/random.h"

namespace tetwarp {
namespace {

using namespace test;

/// Error of `found` in units of the last place of the exact value.
double error_in_ulps(double found, long double exact) {
  const double magnitude = std::abs(static_cast<double>(exact));
  const double ulp = std::nextafter(magnitude, std::numeric_limits<double>::infinity()) - magnitude;
  return static_cast<double>(std::abs(static_cast<long double>(found) - exact)) / ulp;
}

void expect_accurate(double angle) {
  const SinCos found = sin_cos(angle);
  ASSERT_LE(error_in_ulps(found.sin, std::sin(static_cast<long double>(angle))), 2) << "sine of " << angle;
  ASSERT_LE(error_in_ulps(found.cos, std::cos(static_cast<long double>(angle))), 2) << "cosine of " << angle;
}

TEST(SinCos, IsWithinTwoUnitsInTheLastPlace) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  for (int n = 0; n < 200000; ++n) {
    expect_accurate(random.real(-1e5, 1e5));
    expect_accurate(random.real(-8, 8));
    expect_accurate(std::exp(random.real(-40, 11)));
  }
}

TEST(SinCos, IsAccurateBesideItsZerosAndQuarters) {
  for (int quarter = -63000; quarter <= 63000; ++quarter) {
    const double angle = quarter * (std::numbers::pi / 2);
    expect_accurate(angle);
    expect_accurate(std::nextafter(angle, 1e9));
    expect_accurate(angle + 1e-9);
    expect_accurate(angle + std::numbers::pi / 4);
  }
}

TEST(SinCos, ZeroIsExact) {
  EXPECT_EQ(sin_cos(0).sin, 0);
  EXPECT_EQ(sin_cos(0).cos, 1);
}

}  // namespace
}  // namespace tetwarp
