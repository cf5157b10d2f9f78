// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/gamma.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deform/errors.h"

namespace tetwarp::score {
namespace {

/// A dose that falls evenly along x: 100 at 0, by `fall` a mm; off by `shift_mm` along x and by a factor.
Volume<float> ramp(double fall, double shift_mm = 0, double factor = 1) {
  const Geometry grid{.size = {60, 8, 6}, .spacing = {1.5, 2, 2.5}};
  Volume<float> dose{grid, {}};
  for (std::int64_t n = 0; n < voxel_count(grid); ++n) {
    const double x = 1.5 * static_cast<double>(n % 60);
    dose.voxels.push_back(static_cast<float>(factor * (100 - fall * (x - shift_mm))));
  }
  return dose;
}

double passing(const Volume<float>& reference, const Volume<float>& evaluated, const GammaCriterion& criterion = {}) {
  return gamma_score(view(reference), view(evaluated), criterion, {.threads = 2}).passing_percent();
}

TEST(GammaIndex, ADoseAgreesWithItself) {
  const Volume<float> dose = ramp(1);
  const GammaScore score = gamma_score(view(dose), view(dose));
  EXPECT_EQ(score.largest_dose, 100);
  EXPECT_EQ(score.passing, score.points);
  // Doses from 10 on: x up to 90, all 60 columns but those beyond it.
  EXPECT_EQ(score.points, 60U * 8 * 6);
  EXPECT_LT(gamma_score(view(dose), view(dose), {.threshold_percent = 50}).points, score.points);
}

TEST(GammaIndex, ASteepDosePassesByItsDistanceAndAFlatOneByItsDifference) {
  // Where it is steep, at 10 a mm, a shift below 2 mm passes and one above it does not.
  const Volume<float> steep = ramp(10);
  EXPECT_GT(passing(steep, ramp(10, 1.9)), 80);
  EXPECT_LT(passing(steep, ramp(10, 2.5)), 25);
  // Where it is flat the largest dose decides: 3 % of 100.
  const Volume<float> flat = ramp(0);
  EXPECT_EQ(passing(flat, ramp(0, 0, 1.029)), 100);
  EXPECT_EQ(passing(flat, ramp(0, 0, 1.031)), 0);
  EXPECT_EQ(passing(flat, ramp(0, 0, 1.031), {.dose_percent = 4}), 100);
}

TEST(GammaIndex, BothTogetherObeyTheEllipse) {
  // Off by d along a ramp of slope s and looked up at distance r, the difference is s (d - r): the best r passes if
  // d <= sqrt(2^2 + (3 / s)^2), the distance of the line from the ellipse.
  const double slope = 1.2, most = std::sqrt(4 + (3 / slope) * (3 / slope));
  const Volume<float> reference = ramp(slope);
  EXPECT_GT(passing(reference, ramp(slope, 0.98 * most)), 90);
  EXPECT_LT(passing(reference, ramp(slope, 1.02 * most)), 10);
}

TEST(GammaIndex, RefusesWhatCannotBeCompared) {
  const Volume<float> dose = ramp(1);
  Volume<float> other = dose, nothing = dose;
  other.geometry.origin.x += 1;
  for (float& value : nothing.voxels) value = 0;
  EXPECT_THROW(gamma_score(view(dose), view(other)), InputError);
  EXPECT_THROW(gamma_score(view(nothing), view(dose)), InputError);
  EXPECT_THROW(gamma_score(view(dose), view(dose), {.distance_mm = 0}), InputError);
  EXPECT_EQ(gamma_score(view(dose), view(nothing)).passing, 0U);
}

}  // namespace
}  // namespace tetwarp::score
