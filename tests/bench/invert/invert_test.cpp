// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What `invert` knows of its fields, and what it says of an inverse that is wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "bench/invert/invert.h"
#include "bench/peers/peers.h"

namespace tetwarp::bench {
namespace {

constexpr glm::i64vec3 kSize{48, 48, 30};

template <class F>
void for_each_voxel(const glm::i64vec3& size, F&& f) {
  std::size_t n = 0;
  for (std::int64_t k = 0; k < size.z; ++k) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) f(glm::dvec3(i, j, k), n++);
    }
  }
}

/// The known inverse, with what `change` makes of each vector.
template <class Change>
std::vector<glm::vec3> inverse_with(const KnownField& known, Change&& change) {
  std::vector<glm::vec3> inverse(known.field.displacement.size());
  for_each_voxel(known.field.lattice.size, [&](const glm::dvec3& voxel, std::size_t n) {
    const Origin origin = known.origin(voxel);
    inverse[n] = change(origin, glm::vec3(origin.displacement), voxel);
  });
  return inverse;
}

/// NaN where there is no source.
glm::vec3 or_none(const Origin& origin, const glm::vec3& vector) {
  return origin.outside > 0 ? glm::vec3(NAN) : vector;
}

std::uint64_t all_voxels() { return static_cast<std::uint64_t>(kSize.x * kSize.y * kSize.z); }

TEST(InvertFields, TheInverseLeadsBackFromWhereAVertexWent) {
  for (const std::string name : {"wave", "twist", "bubble"}) {
    const KnownField known = make_known_field(name, kSize, 2);
    float moved = 0;
    for_each_voxel(kSize, [&](const glm::dvec3& vertex, std::size_t n) {
      const glm::vec3 by = known.field.displacement[n];
      moved = std::max(moved, glm::length(by));
      const Origin origin = known.origin(vertex + glm::dvec3(by));
      ASSERT_LT(glm::length(origin.displacement + glm::dvec3(by)), 1e-5) << name << ", vertex " << n;
      ASSERT_LT(origin.outside, 1e-5) << name << ", vertex " << n;
    });
    EXPECT_GT(moved, 0.5f) << name;
  }
}

TEST(InvertFields, OutsideIsTheDistanceToTheLattice) {
  const KnownField bubble = make_known_field("bubble", kSize, 2);
  EXPECT_EQ(bubble.origin({0, 20, 29}).outside, 0) << "at rest on the border";
  EXPECT_EQ(bubble.origin({-2, 20, 10}).outside, 2);
  EXPECT_EQ(bubble.origin({20, 50, 30}).outside, 3);
  EXPECT_EQ(bubble.origin({5, 6, 3}).outside, -3);
}

TEST(InvertFields, AFieldThatFoldsReachesAllButItsFirstAndLastColumns) {
  const KnownField folds = make_known_field("folds", {128, 8, 6}, 2);
  for_each_voxel({128, 8, 6}, [&](const glm::dvec3& voxel, std::size_t) {
    const Origin origin = folds.origin(voxel);
    EXPECT_EQ(origin.outside > 0, voxel.x == 0 || voxel.x == 127) << voxel.x;
    EXPECT_TRUE(std::isnan(origin.displacement.x));
  });
  EXPECT_NEAR(folds.origin({0, 0, 0}).outside, 16 * std::sin(2 * std::numbers::pi * 0.5 / 64), 1e-5);
}

TEST(InvertFields, FieldsWithoutAKnownInverseAreRefused) {
  for (const std::string name : {"identity", "elastic", "noise", "swirl"}) {
    EXPECT_THROW(make_known_field(name, kSize, 2), InputError) << name;
  }
}

TEST(InvertAccuracy, TheKnownInverseIsRight) {
  for (const std::string name : {"wave", "twist", "bubble"}) {
    const KnownField known = make_known_field(name, kSize, 2);
    const Accuracy found = compare_inverse(
        known, inverse_with(known, [](const Origin& origin, const glm::vec3& v, auto&) { return or_none(origin, v); }));
    EXPECT_LT(found.largest, 1e-6) << name;
    EXPECT_EQ(found.left_out, 0u) << name;
    EXPECT_EQ(found.written, 0u) << name;
    EXPECT_EQ(found.without_source > 0, name != "bubble") << name;
    EXPECT_NEAR(static_cast<double>(found.with_source + found.without_source), static_cast<double>(all_voxels()), 50)
        << name;
  }
}

TEST(InvertAccuracy, AnInverseThatIsOffByHalfAVoxelIsOffByHalfAVoxel) {
  const KnownField known = make_known_field("twist", kSize, 2);
  const Accuracy found = compare_inverse(
      known, inverse_with(known, [](auto&, const glm::vec3& v, auto&) { return v + glm::vec3(0.3f, 0, -0.4f); }));
  for (const double error : {found.mean, found.percentile_99, found.largest}) EXPECT_NEAR(error, 0.5, 1e-6);
}

TEST(InvertAccuracy, TheForwardFieldTakenForItsInverseIsOffByTwiceTheField) {
  const KnownField wave = make_known_field("wave", kSize, 2);
  double sum = 0, largest = 0;
  int count = 0;
  for_each_voxel(kSize, [&](const glm::dvec3& voxel, std::size_t n) {
    if (wave.origin(voxel).outside > 0) return;
    const double error = 2 * std::abs(static_cast<double>(wave.field.displacement[n].x));
    sum += error;
    largest = std::max(largest, error);
    ++count;
  });
  const Accuracy found = compare_inverse(wave, wave.field.displacement);
  EXPECT_GT(largest, 2.5);
  EXPECT_NEAR(found.largest, largest, 1e-6);
  EXPECT_NEAR(found.mean, sum / count, 1e-6);
}

TEST(InvertAccuracy, AFewWrongVectorsShowInTheLargestErrorAndNotInThePercentile) {
  const KnownField known = make_known_field("bubble", kSize, 2);
  std::vector<glm::vec3> inverse = inverse_with(known, [](auto&, const glm::vec3& v, auto&) { return v; });
  for (std::size_t n = 0; n < inverse.size() / 200; ++n) inverse[n].y += 3;
  const Accuracy found = compare_inverse(known, inverse);
  EXPECT_NEAR(found.largest, 3, 1e-6);
  EXPECT_LT(found.percentile_99, 1e-6);
  EXPECT_NEAR(found.mean, 3.0 / 200, 1e-4);
}

TEST(InvertAccuracy, AMissingVectorIsLeftOutAndNoError) {
  const KnownField known = make_known_field("bubble", kSize, 2);
  std::vector<glm::vec3> inverse = inverse_with(known, [](auto&, const glm::vec3& v, auto&) { return v; });
  inverse[7].z = NAN;
  inverse[1000] = glm::vec3(INFINITY);
  const Accuracy found = compare_inverse(known, inverse);
  EXPECT_EQ(found.left_out, 2u);
  EXPECT_EQ(found.with_source, all_voxels());
  EXPECT_LT(found.largest, 1e-6);
}

TEST(InvertAccuracy, VectorsWithoutASourceAreCountedByWhatTheySay) {
  const KnownField folds = make_known_field("folds", {128, 8, 6}, 2);
  const auto count = [&](const glm::vec3& vector) {
    return compare_inverse(folds, std::vector<glm::vec3>(128 * 8 * 6, vector));
  };
  constexpr std::uint64_t kEmpty = 2 * 8 * 6;
  const Accuracy none = count(glm::vec3(NAN)), zero = count(glm::vec3(0)), right = count({1, 0, 0});
  EXPECT_EQ(none.without_source, kEmpty);
  EXPECT_EQ(none.written + none.zero + none.pointing_in, 0u);
  EXPECT_EQ(none.left_out, none.with_source);
  EXPECT_EQ(zero.written, kEmpty);
  EXPECT_EQ(zero.zero, kEmpty);
  EXPECT_EQ(zero.pointing_in, kEmpty);
  EXPECT_EQ(right.written, kEmpty);
  EXPECT_EQ(right.zero, 0u);
  EXPECT_EQ(right.pointing_in, kEmpty / 2) << "only from the first column a step to the right is in the lattice";
  EXPECT_FALSE(zero.is_compared());
}

TEST(InvertAccuracy, AnotherNumberOfVectorsIsRefused) {
  const KnownField known = make_known_field("wave", kSize, 2);
  EXPECT_THROW(compare_inverse(known, std::vector<glm::vec3>(10)), InputError);
}

Json measure(const std::vector<std::string>& fields, const std::vector<std::string>& peers, int repeats = 1) {
  Options options = default_options("invert");
  options.input.width = 64;
  options.input.slices = {38};
  options.fields = fields;
  options.peers = peers;
  options.threads = 2;
  options.repeats = repeats;
  return measure_invert(options);
}

TEST(InvertBench, TetwarpsInverseIsWithinItsRoundingAndWritesNothingWithoutASource) {
  const Json runs = measure({"wave", "twist", "bubble", "folds"}, {}, 2);
  ASSERT_EQ(runs.size(), 4u);
  for (const Json& run : runs) {
    EXPECT_EQ(run["by"], "tetwarp");
    EXPECT_EQ(run["ms"]["frames"], 2);
    EXPECT_EQ(run["written_without_source"], 0u) << run["field"];
    EXPECT_EQ(run["left_out"], 0u) << run["field"];
    if (run["field"] == "wave" || run["field"] == "twist") {
      EXPECT_LT(*number(run, "/largest_error"), 5e-4) << run["field"] << ": affine in each slice";
    }
  }
  EXPECT_LT(*number(runs[2], "/mean_error"), 1e-2);
  EXPECT_TRUE(runs[3]["mean_error"].is_null());
}

TEST(InvertBench, ItksInvertersAnswerTheSameQuestion) {
  if (!itk_version()) GTEST_SKIP() << "ITK is not in this build";
  const Json runs = measure({"wave"}, {"itk-invert", "itk-invert-free", "itk-iterative"});
  ASSERT_EQ(runs.size(), 4u);
  const Json &fixed = runs[1], &free = runs[2], &iterative = runs[3];
  EXPECT_NEAR(*number(fixed, "/largest_error"), 2 * std::sin(2 * std::numbers::pi * 3.5 / 16), 1e-4)
      << "the border is held at 0";
  EXPECT_LT(*number(free, "/largest_error"), 1e-3);
  EXPECT_LT(*number(iterative, "/largest_error"), 1e-3);
  for (const Json* one : {&fixed, &free, &iterative}) {
    EXPECT_GT((*one)["without_source"], 0u);
    EXPECT_EQ((*one)["written_without_source"], (*one)["without_source"]);
  }
  EXPECT_GT(fixed["zero_without_source"], 0u);
  EXPECT_EQ(free["zero_without_source"], 0u);
}

}  // namespace
}  // namespace tetwarp::bench
