// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/phantom.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tetwarp {
namespace {

const glm::dvec3 kFieldOfView(410, 410, 300);

Volume<std::int16_t> phantom_of(const glm::i64vec3& size, std::uint64_t seed = 1) {
  return make_phantom(size, kFieldOfView / glm::dvec3(size), seed);
}

/// The standard phantom of these tests, made once.
const Volume<std::int16_t>& body() {
  static const Volume<std::int16_t> volume = phantom_of({256, 256, 150});
  return volume;
}

std::int16_t at(const Volume<std::int16_t>& volume, std::int64_t i, std::int64_t j, std::int64_t k) {
  const glm::i64vec3 size = volume.geometry.size;
  return volume.voxels[static_cast<std::size_t>(i + size.x * (j + size.y * k))];
}

struct Statistics {
  double mean, deviation;
};

/// Statistics of the voxels within `radius_mm` of a point in LPS mm.
Statistics around(const Volume<std::int16_t>& volume, const glm::dvec3& point, double radius_mm) {
  const Geometry& grid = volume.geometry;
  const glm::dvec3 middle = index_from_point(grid)(point), reach = radius_mm / grid.spacing;
  double count = 0, sum = 0, squares = 0;
  for (auto k = static_cast<std::int64_t>(std::ceil(middle.z - reach.z)); static_cast<double>(k) <= middle.z + reach.z;
       ++k) {
    for (auto j = static_cast<std::int64_t>(std::ceil(middle.y - reach.y));
         static_cast<double>(j) <= middle.y + reach.y; ++j) {
      for (auto i = static_cast<std::int64_t>(std::ceil(middle.x - reach.x));
           static_cast<double>(i) <= middle.x + reach.x; ++i) {
        const double hu = at(volume, i, j, k);
        count += 1, sum += hu, squares += hu * hu;
      }
    }
  }
  return {sum / count, std::sqrt(squares / count - sum * sum / (count * count))};
}

std::int64_t count_between(const Volume<std::int16_t>& volume, int low, int high) {
  return std::count_if(volume.voxels.begin(), volume.voxels.end(), [&](int hu) { return hu >= low && hu <= high; });
}

TEST(Phantom, GridIsAxialLpsWithItsMiddleAtTheOrigin) {
  const Volume<std::int16_t> volume = make_phantom({20, 18, 16}, {2, 3, 4}, 1);
  EXPECT_EQ(volume.geometry.size, glm::i64vec3(20, 18, 16));
  EXPECT_EQ(volume.geometry.spacing, glm::dvec3(2, 3, 4));
  EXPECT_EQ(volume.geometry.direction, glm::dmat3(1));
  EXPECT_EQ(centre(volume.geometry), glm::dvec3(0));
  EXPECT_EQ(volume.voxels.size(), 20u * 18u * 16u);
}

TEST(Phantom, SameSeedGivesSameBits) {
  EXPECT_EQ(phantom_of({48, 40, 32}, 7).voxels, phantom_of({48, 40, 32}, 7).voxels);
}

TEST(Phantom, BitsAreIndependentOfThreadCount) {
  const auto many = phantom_of({48, 48, 24});
  const oneapi::tbb::global_control one_thread(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(phantom_of({48, 48, 24}).voxels, many.voxels);
}

TEST(Phantom, AnotherSeedChangesNoiseAndAnatomy) {
  const auto one = phantom_of({96, 96, 48}, 1), two = phantom_of({96, 96, 48}, 2);
  std::size_t differ = 0, differ_much = 0;
  for (std::size_t i = 0; i < one.voxels.size(); ++i) {
    const int difference = std::abs(one.voxels[i] - two.voxels[i]);
    differ += difference != 0;
    differ_much += difference > 200;
  }
  EXPECT_GT(differ, one.voxels.size() / 2);
  EXPECT_GT(differ_much, one.voxels.size() / 200);
}

TEST(Phantom, BitsOfSmallVolumeAreThoseOfEveryMachine) {
  const auto volume = phantom_of({32, 32, 24}, 3);
  std::uint64_t fingerprint = 1469598103934665603u;  // FNV-1a over the voxels
  for (const std::int16_t hu : volume.voxels)
    fingerprint = (fingerprint ^ static_cast<std::uint16_t>(hu)) * 1099511628211u;
  EXPECT_EQ(fingerprint, 7053960783738779675u);
}

TEST(Phantom, ValuesAreThoseOfCt) {
  const auto [low, high] = std::minmax_element(body().voxels.begin(), body().voxels.end());
  EXPECT_GE(*low, -1024);
  EXPECT_LE(*high, 1600);
  EXPECT_GT(*high, 700);
}

TEST(Phantom, AirIsOutsideAndBodyInside) {
  for (const std::int64_t k : {std::int64_t{0}, std::int64_t{75}, std::int64_t{149}}) {
    for (const std::int64_t i : {std::int64_t{1}, std::int64_t{128}, std::int64_t{254}}) {
      EXPECT_LE(at(body(), i, 2, k), -950) << "in front of the body, column " << i << ", slice " << k;
    }
  }
  const auto tissue = count_between(body(), -150, 2000);
  EXPECT_GT(tissue, voxel_count(body().geometry) / 5);
  EXPECT_LT(tissue, voxel_count(body().geometry) / 2);
}

struct Place {
  const char* organ;
  glm::dvec3 point;  ///< LPS mm
  double radius_mm, low_hu, high_hu;
};

TEST(Phantom, OrgansHaveTheirHounsfieldUnits) {
  const Place places[] = {{"air", {0, -180, 0}, 8, -1010, -980},
                          {"right lung", {-85, 10, 20}, 10, -900, -700},
                          {"left lung", {90, 20, 20}, 10, -900, -700},
                          {"trachea", {-1, 6, 110}, 3, -1010, -880},
                          {"liver", {-80, 10, -80}, 10, 50, 90},
                          {"spleen", {98, 36, -104}, 5, 45, 80},
                          {"descending aorta", {21, 32, -10}, 4, 120, 165},
                          {"fat under the skin", {0, -108, -60}, 2.5, -130, -60},
                          {"vertebra", {0, 52, 148 - 6 * 23.5}, 3, 130, 400}};
  for (const Place& place : places) {
    const double hu = around(body(), place.point, place.radius_mm).mean;
    EXPECT_GE(hu, place.low_hu) << place.organ;
    EXPECT_LE(hu, place.high_hu) << place.organ;
  }
}

TEST(Phantom, NoAirLiesInTheShoulders) {
  std::int64_t air = 0;
  for (std::int64_t k = 138; k < body().geometry.size.z; ++k) {
    for (std::int64_t j = 100; j < 160; ++j) {
      for (std::int64_t i = 60; i < 200; ++i)
        air += std::abs(i - 128) > 42 && at(body(), i, j, k) < -300;  // beside the lungs
    }
  }
  EXPECT_EQ(air, 0);
}

TEST(Phantom, NoiseInTheLiverIsThatOfCt) {
  const Statistics liver = around(body(), {-80, 10, -80}, 8);
  EXPECT_GT(liver.deviation, 8);
  EXPECT_LT(liver.deviation, 25);
}

TEST(Phantom, LiverIsOnThePatientsRightAndStomachGasInFront) {
  EXPECT_GT(around(body(), {-80, -10, -75}, 6).mean, 40);
  EXPECT_LT(around(body(), {75, -45, -86}, 3).mean, -800) << "gas rises to the front of somebody who lies on the back";
  EXPECT_GT(around(body(), {70, -10, -86}, 4).mean, -60);
}

TEST(Phantom, BodyScalesWithTheFieldOfView) {
  const auto normal = make_phantom({64, 64, 48}, {6.4, 6.4, 6.25}, 5),
             large = make_phantom({64, 64, 48}, {12.8, 12.8, 12.5}, 5);
  EXPECT_EQ(normal.voxels, large.voxels);
}

TEST(Phantom, SmallestSizesWork) {
  EXPECT_EQ(make_phantom({2, 2, 2}, {200, 200, 150}, 1).voxels.size(), 8u);
  const auto small = phantom_of({16, 16, 16});
  EXPECT_GT(count_between(small, -150, 2000), 16 * 16 * 16 / 5);
  EXPECT_GT(count_between(small, -1024, -950), 16 * 16 * 16 / 5);
}

TEST(Phantom, RefusesSizesAndSpacingsThatAreNone) {
  EXPECT_THROW(make_phantom({1, 16, 16}, {1, 1, 1}, 1), InputError);
  EXPECT_THROW(make_phantom({16, 0, 16}, {1, 1, 1}, 1), InputError);
  EXPECT_THROW(make_phantom({16, 16, 16}, {1, -1, 1}, 1), InputError);
  EXPECT_THROW(make_phantom({16, 16, 16}, {1, 1, NAN}, 1), InputError);
}

TEST(Phantom, LabelsSayWhatVoxelsBelongTo) {
  const glm::i64vec3 size(128, 128, 75);
  const LabelledPhantom made = make_labelled_phantom(size, kFieldOfView / glm::dvec3(size), 1);
  EXPECT_EQ(made.ct.voxels, phantom_of(size).voxels);
  struct Range {
    PhantomLabel label;
    double litres_from, litres_to, mean_from, mean_to;
  };
  const double litre = 1e6 / (made.ct.geometry.spacing.x * made.ct.geometry.spacing.y * made.ct.geometry.spacing.z);
  for (const Range& range :
       {Range{PhantomLabel::nothing, 20, 40, -1024, -900}, Range{PhantomLabel::body, 8, 16, -100, 60},
        Range{PhantomLabel::lung, 2, 5, -880, -750}, Range{PhantomLabel::bone, 0.7, 3, 250, 900},
        Range{PhantomLabel::heart, 0.3, 0.9, 40, 130}, Range{PhantomLabel::vessel, 0.1, 0.6, 90, 150},
        Range{PhantomLabel::airway, 0.02, 0.15, -990, -300}, Range{PhantomLabel::oesophagus, 0.01, 0.1, -200, 60},
        Range{PhantomLabel::liver, 0.9, 2.2, 55, 80}, Range{PhantomLabel::spleen, 0.1, 0.4, 50, 75},
        Range{PhantomLabel::kidney, 0.07, 0.5, 60, 130}, Range{PhantomLabel::stomach, 0.1, 0.4, -700, 30},
        Range{PhantomLabel::bowel, 0.2, 1.5, -600, 60}, Range{PhantomLabel::cord, 0.03, 0.12, 5, 60}}) {
    double count = 0, sum = 0;
    for (std::size_t n = 0; n < made.labels.voxels.size(); ++n) {
      if (made.labels.voxels[n] != static_cast<std::uint8_t>(range.label)) continue;
      count += 1, sum += made.ct.voxels[n];
    }
    const std::string_view name = phantom_label_names()[static_cast<std::size_t>(range.label)];
    EXPECT_GT(count / litre, range.litres_from) << name;
    EXPECT_LT(count / litre, range.litres_to) << name;
    EXPECT_GT(sum / count, range.mean_from) << name;
    EXPECT_LT(sum / count, range.mean_to) << name;
  }
}

TEST(Phantom, NoiseIsAsWished) {
  const glm::i64vec3 size(64, 64, 40);
  const auto with = [&](double hu) { return make_phantom(size, kFieldOfView / glm::dvec3(size), 1, {.noise_hu = hu}); };
  const Volume<std::int16_t> none = with(0), some = with(25);
  double squares = 0;
  for (std::size_t n = 0; n < none.voxels.size(); ++n) squares += std::pow(some.voxels[n] - none.voxels[n], 2);
  // Noise below -1024 HU is cut off, in air.
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(none.voxels.size())), 25, 2);
  EXPECT_THROW(with(-1), InputError);
  EXPECT_THROW(with(NAN), InputError);
}

}  // namespace
}  // namespace tetwarp
