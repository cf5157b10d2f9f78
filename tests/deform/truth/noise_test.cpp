// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/noise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deform/errors.h"

namespace tetwarp::truth {
namespace {

const Geometry kGrid{.size = {96, 90, 12}, .spacing = {1, 1, 2}};

Volume<std::int16_t> water(std::int16_t hu = 40) {
  return {kGrid, std::vector<std::int16_t>(static_cast<std::size_t>(voxel_count(kGrid)), hu)};
}

Volume<std::int16_t> noisy(const Noise& noise, std::uint64_t seed, const Limits& limits = {}) {
  Volume<std::int16_t> volume = water();
  add_noise(view(std::as_const(volume)), noise, seed, view(volume), limits);
  return volume;
}

/// Covariance of noise at a lag within slices.
double covariance(const Volume<std::int16_t>& volume, std::int64_t dx, std::int64_t dy) {
  double sum = 0;
  std::int64_t count = 0;
  for (std::int64_t k = 0; k < 12; ++k)
    for (std::int64_t j = 0; j + dy < 90; ++j)
      for (std::int64_t i = 0; i + dx < 96; ++i, ++count) {
        const auto at = [&](std::int64_t x, std::int64_t y) {
          return volume.voxels[static_cast<std::size_t>(x + 96 * (y + 90 * k))] - 40.0;
        };
        sum += at(i, j) * at(i + dx, j + dy);
      }
  return sum / static_cast<double>(count);
}

TEST(TruthNoise, HasTheWantedPowerAndGrain) {
  const Volume<std::int16_t> volume = noisy(smoothed_noise(15), 3);
  EXPECT_NEAR(std::sqrt(covariance(volume, 0, 0)), 15, 0.5);
  // Of the weights 1, 2, 1 neighbours share (2 + 2) / 6, those two apart 1 / 6.
  EXPECT_NEAR(covariance(volume, 1, 0) / 225, 4.0 / 6, 0.04);
  EXPECT_NEAR(covariance(volume, 0, 2) / 225, 1.0 / 6, 0.04);
  EXPECT_NEAR(covariance(volume, 3, 0) / 225, 0, 0.04);
}

TEST(TruthNoise, DependsOnItsSeedAloneAndLeavesAir) {
  const Noise noise = smoothed_noise(15);
  EXPECT_EQ(noisy(noise, 3, {.threads = 1}).voxels, noisy(noise, 3, {.threads = 3}).voxels);
  const Volume<std::int16_t> first = noisy(noise, 3), second = noisy(noise, 4);
  double products = 0;
  for (std::size_t n = 0; n < first.voxels.size(); ++n)
    products += (first.voxels[n] - 40.0) * (second.voxels[n] - 40.0);
  EXPECT_NEAR(products / static_cast<double>(first.voxels.size()) / 225, 0, 0.02);
  EXPECT_NE(noise_seed(1, "moving"), noise_seed(1, "shift"));
  Volume<std::int16_t> padding = water(-2000);
  add_noise(view(std::as_const(padding)), noise, 1, view(padding));
  EXPECT_EQ(padding.voxels, water(-2000).voxels);
}

TEST(TruthNoise, IsMeasuredAsItWasMade) {
  const Volume<std::int16_t> volume = noisy(smoothed_noise(20), 5);
  const Noise found = measure_noise(view(volume), {.threads = 2});
  EXPECT_NEAR(found.deviation, 20, 0.8);
  ASSERT_EQ(found.radius, 4);
  double squares = 0;
  for (const float weight : found.kernel) squares += static_cast<double>(weight) * static_cast<double>(weight);
  EXPECT_NEAR(squares, 1, 1e-6);
  const Volume<std::int16_t> again = noisy(found, 77);
  for (const auto& [dx, dy] : {std::pair(0, 0), std::pair(1, 0), std::pair(0, 1), std::pair(2, 0), std::pair(1, 1)})
    EXPECT_NEAR(covariance(again, dx, dy) / 400, covariance(volume, dx, dy) / 400, 0.06) << dx << " " << dy;
  EXPECT_EQ(measure_noise(view(volume), {.threads = 1}).kernel, found.kernel);
  EXPECT_EQ(measure_noise(view(water())).deviation, 0);
}

TEST(TruthNoise, RefusesWhatHasNoSoftTissue) {
  EXPECT_THROW(measure_noise(view(water(-900))), InputError);
  const Geometry one{.size = {96, 90, 1}, .spacing = {1, 1, 2}};
  const Volume<std::int16_t> slice{one, std::vector<std::int16_t>(96 * 90, 40)};
  EXPECT_THROW(measure_noise(view(slice)), InputError);
}

}  // namespace
}  // namespace tetwarp::truth
