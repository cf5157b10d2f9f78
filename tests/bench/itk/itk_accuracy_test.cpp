// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What `itk` takes for the truth, and what it says of a result that is wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bench/harness/known_fields.h"
#include "bench/itk/itk_accuracy.h"
#include "deform/phantom.h"

namespace tetwarp::bench {
namespace {

constexpr glm::i64vec3 kSize{48, 40, 30};

std::size_t voxels() { return static_cast<std::size_t>(kSize.x * kSize.y * kSize.z); }

/// Places all over the volume, none on a voxel.
std::vector<glm::dvec3> places() {
  std::vector<glm::dvec3> found;
  for (int n = 0; n < 500; ++n)
    found.push_back(
        glm::fract(glm::dvec3(0.1, 0.3, 0.7) + static_cast<double>(n) * glm::dvec3(0.7548777, 0.5698403, 0.3819660)) *
        glm::dvec3(kSize - std::int64_t{1}));
  return found;
}

struct Scene {
  Geometry grid{.size = kSize};
  SmoothField field;
  PullField inverse;

  explicit Scene(const std::string& name)
      : field(make_smooth_field(name, kSize)), inverse(invert_closely(field, grid, 2)) {}
  TrueInverse truth() const { return {&inverse.grid, inverse.displacement}; }
};

TEST(SmoothFields, TheDerivativeIsWhatDifferencesComeTo) {
  constexpr double kStep = 1e-4;
  for (const std::string name : {"bubble", "elastic"}) {
    const SmoothField field = make_smooth_field(name, kSize);
    double largest = 0;
    for (const glm::dvec3& place : places()) {
      const glm::dmat3 derivative = field.derivative(place);
      for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 step(0);
        step[axis] = kStep;
        const glm::dvec3 slope = (field.displacement(place + step) - field.displacement(place - step)) / (2 * kStep);
        ASSERT_LT(glm::distance(slope, derivative[axis]), 1e-5) << name;
        largest = std::max(largest, glm::length(slope));
      }
    }
    EXPECT_GT(largest, 0.1) << name;
  }
}

TEST(SmoothFields, TheInverseLeadsBackFromWhereAPointWent) {
  for (const std::string name : {"bubble", "elastic"}) {
    const SmoothField field = make_smooth_field(name, kSize);
    for (const glm::dvec3& rest : places()) {
      const glm::dvec3 went = rest + field.displacement(rest);
      const PullField back = invert_closely(field, {.size = {2, 1, 1}, .origin = went}, 1);
      ASSERT_LT(glm::distance(went + glm::dvec3(back.displacement[0]), rest), 1e-5) << name;
    }
  }
}

TEST(SmoothFields, TheBubblesInverseIsThatOfItsRadialProfile) {
  const Scene scene("bubble");
  const KnownField known = make_known_field("bubble", kSize, 2);
  std::size_t number = 0;
  for (std::int64_t k = 0; k < kSize.z; ++k) {
    for (std::int64_t j = 0; j < kSize.y; ++j) {
      for (std::int64_t i = 0; i < kSize.x; ++i, ++number) {
        const glm::dvec3 expected = known.origin({i, j, k}).displacement;
        ASSERT_LT(glm::distance(glm::dvec3(scene.inverse.displacement[number]), expected), 1e-6) << number;
      }
    }
  }
}

TEST(SmoothFields, FieldsWithoutADerivativeAreRefused) { EXPECT_THROW(make_smooth_field("wave", kSize), InputError); }

TEST(ItkAccuracy, TheTrueInverseIsRightAndAnotherIsOffByWhatItIsOff) {
  const Scene scene("elastic");
  const Deviation right = compare_inverse_field(scene.inverse.displacement, scene.truth());
  EXPECT_EQ(right.largest, 0);
  EXPECT_EQ(right.missing, 0u);
  EXPECT_LT(right.compared, voxels()) << "some comes from outside";
  EXPECT_GT(right.compared, voxels() / 2);
  std::vector<glm::vec3> wrong = scene.inverse.displacement;
  for (glm::vec3& vector : wrong) vector += glm::vec3(0.3f, 0, -0.4f);
  const Deviation off = compare_inverse_field(wrong, scene.truth());
  for (const double error : {off.rms, off.mean, off.largest}) EXPECT_NEAR(error, 0.5, 1e-6);
}

TEST(ItkAccuracy, WhatIsNotFiniteIsMissingAndNoError) {
  const Scene scene("bubble");
  std::vector<glm::vec3> found = scene.inverse.displacement;
  found[voxels() / 2].y = NAN;
  const Deviation deviation = compare_inverse_field(found, scene.truth());
  EXPECT_EQ(deviation.missing, 1u);
  EXPECT_EQ(deviation.compared, voxels() - 1);
  EXPECT_EQ(deviation.largest, 0);
}

TEST(ItkAccuracy, AVolumeIsHeldAgainstItsSourceAtTheUndeformedPlaces) {
  const Scene scene("elastic");
  const Volume<std::int16_t> source = make_phantom(kSize, {1, 1, 1}, 1);
  const Deviation still = compare_volume(source.voxels, source.voxels, scene.truth());
  EXPECT_GT(still.rms, 20) << "the source is not the warped volume";
  const PullField rest{scene.grid, std::vector<glm::vec3>(voxels())};
  std::vector<std::int16_t> shifted = source.voxels;
  for (std::int16_t& voxel : shifted) voxel = static_cast<std::int16_t>(voxel - 3);
  const Deviation off = compare_volume(shifted, source.voxels, {&rest.grid, rest.displacement});
  for (const double error : {off.rms, off.mean, off.largest}) EXPECT_EQ(error, 3);
  EXPECT_EQ(off.compared, static_cast<std::size_t>((kSize.x - 2) * (kSize.y - 2) * (kSize.z - 2)));
}

TEST(ItkAccuracy, HalfWayBetweenVoxelsATrueVolumeIsTheirMean) {
  std::vector<std::int16_t> source(voxels()), halfway(voxels());
  for (std::size_t n = 0; n < voxels(); ++n) {
    const auto i = static_cast<std::int64_t>(n) % kSize.x;
    source[n] = static_cast<std::int16_t>(i * i);
    halfway[n] = static_cast<std::int16_t>((i * i + (i + 1) * (i + 1)) / 2);  // less a half
  }
  const Geometry grid{.size = kSize};
  const PullField half{grid, std::vector<glm::vec3>(voxels(), glm::vec3(0.5f, 0, 0))};
  const Deviation found = compare_volume(halfway, source, {&half.grid, half.displacement});
  EXPECT_EQ(found.mean, 0.5);
  EXPECT_EQ(found.largest, 0.5);
}

TEST(ItkAccuracy, DeterminantsAreComparedWhereEachFilterHasThem) {
  const Scene scene("elastic");
  std::vector<float> at_rest(voxels()), deformed(voxels());
  for (std::size_t n = 0; n < voxels(); ++n) {
    const auto number = static_cast<std::int64_t>(n);
    const glm::dvec3 voxel(number % kSize.x, number / kSize.x % kSize.y, number / kSize.x / kSize.y);
    at_rest[n] = static_cast<float>(determinant(scene.field, voxel));
    deformed[n] = static_cast<float>(determinant(scene.field, voxel + glm::dvec3(scene.inverse.displacement[n])));
  }
  EXPECT_LT(compare_rest_determinants(at_rest, scene.field, scene.grid).largest, 1e-6);
  EXPECT_LT(compare_determinants(deformed, scene.field, scene.truth()).largest, 1e-6);
  EXPECT_GT(compare_rest_determinants(deformed, scene.field, scene.grid).rms, 0.05);
  EXPECT_GT(compare_determinants(at_rest, scene.field, scene.truth()).rms, 0.05);
}

TEST(ItkAccuracy, AnotherNumberOfValuesIsRefused) {
  const Scene scene("bubble");
  EXPECT_THROW(compare_inverse_field(std::vector<glm::vec3>(7), scene.truth()), InputError);
  EXPECT_THROW(compare_rest_determinants(std::vector<float>(7), scene.field, scene.grid), InputError);
}

}  // namespace
}  // namespace tetwarp::bench
