// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/registration_score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "deform/fields/formula.h"
#include "deform/fields/point_map.h"
#include "deform/score/overlap.h"
#include "tests/support/fields.h"

namespace tetwarp::score {
namespace {

using namespace test;

/// A fixed volume of known truth: a bubble on an oblique grid.
struct Scene {
  Geometry grid = oblique_grid({34, 30, 26});
  VertexField field = sample_on(lattice_over(grid, 4), Bubble{22, 0.6, centre(grid)});
  std::unique_ptr<ForwardResampler> truth = make_cpu_resampler(grid);
  std::vector<std::uint8_t> everywhere =
      std::vector<std::uint8_t>(static_cast<std::size_t>(voxel_count(grid)), std::uint8_t{1});

  Scene() { truth->set_field(view(field, Outside::background)); }

  PullField exact() const {
    PullField inverse{grid, std::vector<glm::vec3>(everywhere.size())};
    truth->resample(whole(grid), {}, {.inverse_mm = samples_of(inverse)});
    return inverse;
  }
  DenseScore score(const PullField& result, const Limits& limits = {}) const {
    return score_field(*truth, result, everywhere, {}, limits);
  }
};

TEST(RegistrationScore, TruthAgainstItselfIsZero) {
  const Scene scene;
  const DenseScore score = scene.score(scene.exact());
  EXPECT_EQ(score.all.points, scene.everywhere.size());
  EXPECT_EQ(score.all.missing, 0U);
  EXPECT_EQ(score.all.largest, 0);
  EXPECT_EQ(score.all.mean, 0);
  EXPECT_EQ(score.folded, 0U);
  EXPECT_GT(score.smallest_determinant, 0.2);
  EXPECT_EQ(score.determinants, 32U * 28 * 24);
  // Differences across faces of tetrahedra are no gradients of one of them.
  EXPECT_LT(score.mean_determinant_error, 0.05);
  EXPECT_EQ(suspected_reading(score), Reading::as_given);
}

TEST(RegistrationScore, AKnownShiftIsItself) {
  const Scene scene;
  PullField shifted = scene.exact();
  for (glm::vec3& by : shifted.displacement) by += glm::vec3(2, 0, 0);
  shifted.displacement[777] += glm::vec3(7, 0, 0);
  const DenseScore score = scene.score(shifted);
  EXPECT_NEAR(score.all.mean, 2 + 7.0 / static_cast<double>(score.all.points), 1e-5);
  EXPECT_NEAR(score.all.median, 2, 0.02);
  EXPECT_NEAR(score.all.percentile_99, 2, 0.02);
  EXPECT_NEAR(score.all.largest, 9, 1e-4);
  const glm::dvec3 worst = point_from_index(scene.grid)(glm::dvec3(777 % 34, 777 / 34 % 30, 777 / 34 / 30));
  EXPECT_EQ(score.all.worst, worst);
}

TEST(RegistrationScore, OtherReadingsOfAResultAreRecognised) {
  const Scene scene;
  const PullField exact = scene.exact();
  const glm::dmat3 index = index_from_point(scene.grid).linear;
  PullField negative = exact, ras = exact, voxels = exact, none = exact;
  for (std::size_t n = 0; n < exact.displacement.size(); ++n) {
    const glm::vec3 by = exact.displacement[n];
    negative.displacement[n] = -by;
    ras.displacement[n] = {-by.x, -by.y, by.z};
    voxels.displacement[n] = glm::vec3(index * glm::dvec3(by));
    none.displacement[n] = glm::vec3(0);
  }
  EXPECT_EQ(suspected_reading(scene.score(negative)), Reading::negative);
  EXPECT_EQ(suspected_reading(scene.score(ras)), Reading::ras);
  EXPECT_EQ(suspected_reading(scene.score(voxels)), Reading::voxels);
  const DenseScore nothing = scene.score(none);
  EXPECT_EQ(suspected_reading(nothing), Reading::as_given);
  EXPECT_EQ(nothing.all.mean, nothing.readings[static_cast<std::size_t>(Reading::nothing)]);
  EXPECT_GT(nothing.all.mean, 0.5);
}

TEST(RegistrationScore, WhatDoesNotCountOrHasNoPlaceIsLeftOut) {
  Scene scene;
  PullField result = scene.exact();
  for (std::size_t n = 0; n < 100; ++n) result.displacement[n] = glm::vec3(NAN);
  for (std::size_t n = 100; n < 300; ++n) result.displacement[n] += glm::vec3(50, 0, 0), scene.everywhere[n] = 0;
  const DenseScore score = scene.score(result);
  EXPECT_EQ(score.all.missing, 100U);
  EXPECT_EQ(score.all.points, scene.everywhere.size() - 300);
  EXPECT_EQ(score.all.largest, 0);
  // What the truth does not cover counts neither: a shift by five voxels.
  const VertexField away =
      uniform_field(scene.field.lattice, glm::vec3(5.0 * scene.grid.spacing.x * scene.grid.direction[0]));
  scene.truth->set_field(view(away, Outside::background));
  const DenseScore shifted = scene.score(scene.exact());
  EXPECT_LT(shifted.all.points, scene.everywhere.size() - 300);
  EXPECT_EQ(shifted.all.missing, 0U);
}

TEST(RegistrationScore, FoldsAreCounted) {
  const Scene scene;
  PullField folded = scene.exact();
  for (std::size_t n = 0; n < folded.displacement.size(); ++n) {
    // Mirrored about a plane across i from index 20 on: two voxels a step backwards.
    const double i = static_cast<double>(n % 34);
    if (i >= 20)
      folded.displacement[n] = glm::vec3(point_from_index(scene.grid).linear * glm::dvec3(-2 * (i - 20), 0, 0));
  }
  const DenseScore score = scene.score(folded);
  EXPECT_GE(score.folded, 12U * 28 * 24);
  EXPECT_NEAR(score.smallest_determinant, -1, 0.3);
}

TEST(RegistrationScore, LabelsAreScoredByThemselvesAndThreadsChangeNothing) {
  const Scene scene;
  PullField result = scene.exact();
  Volume<std::int16_t> labels{scene.grid, std::vector<std::int16_t>(scene.everywhere.size())};
  for (std::size_t n = 0; n < labels.voxels.size(); ++n) {
    labels.voxels[n] = static_cast<std::int16_t>(n % 3 - 1);
    result.displacement[n] += glm::vec3(0, labels.voxels[n], 0.001 * static_cast<double>(n % 17));
  }
  const DenseScore one = score_field(*scene.truth, result, scene.everywhere, view(labels), {.threads = 1}),
                   many = score_field(*scene.truth, result, scene.everywhere, view(labels), {.threads = 3});
  ASSERT_EQ(one.labels.size(), 3U);
  EXPECT_NEAR(one.labels.at(-1).mean, 1, 1e-3);
  EXPECT_NEAR(one.labels.at(0).mean, 0.008, 1e-4);
  EXPECT_NEAR(one.labels.at(1).mean, 1, 1e-3);
  EXPECT_EQ(one.all.mean, many.all.mean);
  EXPECT_EQ(one.all.worst, many.all.worst);
  EXPECT_EQ(one.mean_determinant_error, many.mean_determinant_error);
  for (const auto& [label, errors] : one.labels) EXPECT_EQ(errors.mean, many.labels.at(label).mean);
}

TEST(RegistrationScore, RefusesWhatDoesNotFit) {
  Scene scene;
  PullField other = scene.exact();
  other.grid.size.x -= 1;
  EXPECT_THROW(scene.score(other), InputError);
  scene.everywhere.assign(scene.everywhere.size(), 0);
  EXPECT_THROW(scene.score(scene.exact()), InputError);
  scene.everywhere.pop_back();
  EXPECT_THROW(scene.score(scene.exact()), InputError);
}

TEST(RegistrationScore, PointsAreComparedOneByOne) {
  const std::vector<glm::dvec3> wanted{{0, 0, 0}, {1, 1, 1}, {5, 5, 5}}, found{{0, 0, 3}, {1, 1, 1}, {NAN, 0, 0}};
  const Errors errors = score_points(found, wanted);
  EXPECT_EQ(errors.points, 2U);
  EXPECT_EQ(errors.missing, 1U);
  EXPECT_EQ(errors.mean, 1.5);
  EXPECT_EQ(errors.largest, 3);
  EXPECT_EQ(errors.worst, glm::dvec3(0));
  EXPECT_THROW(score_points(found, std::span(wanted).first(2)), InputError);
}

TEST(LabelOverlap, DiceIsTwiceWhatIsCommon) {
  const Geometry grid = unit_grid({6, 1, 1});
  const auto overlaps = compare_labels(view(Volume<std::uint8_t>{grid, {0, 1, 1, 1, 2, 2}}),
                                       view(Volume<std::int32_t>{grid, {1, 1, 1, 0, 0, 3}}));
  ASSERT_EQ(overlaps.size(), 3U);
  EXPECT_DOUBLE_EQ(overlaps.at(1).dice(), 2.0 * 2 / 6);
  EXPECT_EQ(overlaps.at(2).dice(), 0);
  EXPECT_EQ(overlaps.at(3).first, 0U);
  EXPECT_THROW(compare_labels(view(Volume<float>{grid, std::vector<float>(6)}),
                              view(Volume<float>{grid, std::vector<float>(6)})),
               InputError);
}

}  // namespace
}  // namespace tetwarp::score
