// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/registration_score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
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
  std::unique_ptr<ForwardResampler> resampler = make_cpu_resampler(grid);
  std::unique_ptr<Truth> truth = exact_inverse(*resampler);
  std::vector<Counts> everywhere = std::vector<Counts>(static_cast<std::size_t>(voxel_count(grid)), Counts::yes);

  Scene() { resampler->set_field(view(field, Outside::background)); }

  PullField exact() const {
    PullField inverse{grid, std::vector<glm::vec3>(everywhere.size())};
    resampler->resample(whole(grid), {}, {.inverse_mm = samples_of(inverse)});
    return inverse;
  }
  DenseScore score(const PullField& result) const { return score_field(*truth, result, everywhere); }
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
  for (std::size_t n = 100; n < 300; ++n)
    result.displacement[n] += glm::vec3(50, 0, 0), scene.everywhere[n] = Counts::no;
  const DenseScore score = scene.score(result);
  EXPECT_EQ(score.all.missing, 100U);
  EXPECT_EQ(score.all.points, scene.everywhere.size() - 300);
  EXPECT_EQ(score.all.largest, 0);
  // What the truth does not cover counts neither: a shift by five voxels.
  const VertexField away =
      uniform_field(scene.field.lattice, glm::vec3(5.0 * scene.grid.spacing.x * scene.grid.direction[0]));
  scene.resampler->set_field(view(away, Outside::background));
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
  Volume<std::uint8_t> bands{scene.grid, std::vector<std::uint8_t>(scene.everywhere.size())};
  for (std::size_t n = 0; n < 500; ++n) bands.voxels[n] = 7;
  const std::vector<ConstVolumeView> parts{view(labels), view(bands)};
  const DenseScore one = score_field(*scene.truth, result, scene.everywhere, parts, {.threads = 1}),
                   many = score_field(*scene.truth, result, scene.everywhere, parts, {.threads = 3});
  ASSERT_EQ(one.parts.size(), 2U);
  ASSERT_EQ(one.parts[0].size(), 3U);
  EXPECT_NEAR(one.parts[0].at(-1).mean, 1, 1e-3);
  EXPECT_NEAR(one.parts[0].at(0).mean, 0.008, 1e-4);
  EXPECT_NEAR(one.parts[0].at(1).mean, 1, 1e-3);
  EXPECT_EQ(one.parts[1].at(7).points, 500U);
  EXPECT_EQ(one.parts[1].at(0).points, scene.everywhere.size() - 500);
  EXPECT_EQ(one.all.mean, many.all.mean);
  EXPECT_EQ(one.all.worst, many.all.worst);
  EXPECT_EQ(one.mean_determinant_error, many.mean_determinant_error);
  for (const auto& [label, errors] : one.parts[0]) EXPECT_EQ(errors.mean, many.parts[0].at(label).mean);
}

TEST(RegistrationScore, WhatIsScoredApartDoesNotCountWithTheOthers) {
  Scene scene;
  PullField result = scene.exact();
  for (std::size_t n = 0; n < 900; ++n) {
    scene.everywhere[n] = Counts::apart;
    result.displacement[n] += glm::vec3(0, 0, 4);
  }
  result.displacement[0] = glm::vec3(NAN);
  const DenseScore score = scene.score(result);
  EXPECT_EQ(score.all.points, scene.everywhere.size() - 900);
  EXPECT_EQ(score.all.largest, 0);
  EXPECT_EQ(score.apart.points, 899U);
  EXPECT_EQ(score.apart.missing, 1U);
  EXPECT_NEAR(score.apart.mean, 4, 1e-6);
}

TEST(RegistrationScore, TheForwardMapIsATruthToo) {
  const Scene scene;
  const PointMover mover(scene.grid, view(scene.field, Outside::background));
  // The moving volume lies on another grid, which reaches beyond the fixed one.
  Geometry moving = scene.grid;
  moving.spacing *= 1.3;
  const auto truth = exact_forward(mover, moving, scene.grid, {.threads = 2});
  const AffineMap point = point_from_index(moving);
  const std::vector<Counts> everywhere(static_cast<std::size_t>(voxel_count(moving)), Counts::yes);
  PullField result{moving, {}};
  std::uint64_t known = 0;
  for (std::int64_t k = 0; k < moving.size.z; ++k) {
    for (std::int64_t j = 0; j < moving.size.y; ++j) {
      for (std::int64_t i = 0; i < moving.size.x; ++i) {
        const glm::dvec3 from = point(glm::dvec3(i, j, k));
        glm::dvec3 to = from;
        const bool moved = mover.move(to) == PointStatus::moved;
        const glm::dvec3 index = index_from_point(scene.grid)(to), last(scene.grid.size - std::int64_t{1});
        known += moved && glm::clamp(index, glm::dvec3(0), last) == index;
        result.displacement.push_back(glm::vec3(to - from) + glm::vec3(0, 1, 0));
      }
    }
  }
  const DenseScore score = score_field(*truth, result, everywhere);
  EXPECT_EQ(score.all.points, known);
  EXPECT_LT(known, everywhere.size());
  EXPECT_NEAR(score.all.mean, 1, 1e-6);
  EXPECT_NEAR(score.all.largest, 1, 1e-5);
  EXPECT_LT(score.mean_determinant_error, 0.08);
}

TEST(RegistrationScore, DeterminantsOfMovedPointsAreThoseOfTheResampler) {
  const Scene scene;
  const PointMover mover(scene.grid, view(scene.field, Outside::background));
  std::vector<float> jacobian(scene.everywhere.size());
  const PullField inverse = scene.exact();
  scene.resampler->resample(whole(scene.grid), {},
                            {.jacobian = {&scene.grid, whole(scene.grid), VoxelType::f32, 1,
                                          std::as_writable_bytes(std::span(jacobian)).data()}});
  const AffineMap point = point_from_index(scene.grid);
  std::size_t alike = 0;
  for (std::size_t n = 0; n < jacobian.size(); ++n) {
    glm::dvec3 at = point(glm::dvec3(n % 34, n / 34 % 30, n / 34 / 30)) + glm::dvec3(inverse.displacement[n]);
    double determinant = 0;
    mover.move(at, &determinant);
    alike += std::abs(determinant - static_cast<double>(jacobian[n])) < 1e-5;
  }
  // Beside a face the place as float may lie in the neighbour.
  EXPECT_GT(alike, jacobian.size() * 97 / 100);
}

TEST(RegistrationScore, BetweenSamplesAResultIsTrilinear) {
  const Scene scene;
  PullField field = scene.exact();
  // An affine displacement comes out exactly, anywhere inside.
  const AffineMap point = point_from_index(scene.grid);
  for (std::size_t n = 0; n < field.displacement.size(); ++n)
    field.displacement[n] = glm::vec3(glm::dvec3(n % 34, n / 34 % 30, n / 34 / 30) * 0.25 + 1.0);
  const glm::dvec3 found = displacement_at(field, point(glm::dvec3(3.25, 28.5, 24.75)));
  EXPECT_LT(glm::distance(found, glm::dvec3(3.25, 28.5, 24.75) * 0.25 + 1.0), 1e-6);
  EXPECT_TRUE(std::isnan(displacement_at(field, point(glm::dvec3(3, 29.01, 4))).x));
  field.displacement[0] = glm::vec3(NAN);
  EXPECT_TRUE(std::isnan(displacement_at(field, point(glm::dvec3(0.5, 0.5, 0.5))).x));
  EXPECT_FALSE(std::isnan(displacement_at(field, point(glm::dvec3(1, 0.5, 0.5))).x));
}

TEST(RegistrationScore, BothDirectionsTogetherLeadBack) {
  const Scene scene;
  const PullField there = scene.exact();
  const PointMover mover(scene.grid, view(scene.field, Outside::background));
  const auto truth = exact_forward(mover, scene.grid, scene.grid);
  const PullField back{scene.grid, truth->slab(whole(scene.grid), {}).displacement};
  const Errors exact = consistency(there, back, nullptr, scene.everywhere);
  EXPECT_LT(exact.mean, 0.1);
  EXPECT_LT(exact.missing, scene.everywhere.size() / 20);
  PullField shifted = back;
  for (glm::vec3& by : shifted.displacement) by += glm::vec3(0, 0, 3);
  const Errors off = consistency(there, shifted, nullptr, scene.everywhere, {.threads = 3});
  EXPECT_NEAR(off.mean, 3, 0.05);
  EXPECT_EQ(off.points + off.missing, scene.everywhere.size());
  // Two shifts against their sum, and against another one.
  PullField first{scene.grid, std::vector<glm::vec3>(scene.everywhere.size(), glm::vec3(1, 0, 0))}, second = first,
                                                                                                    sum = first;
  for (glm::vec3& by : second.displacement) by = glm::vec3(0, 2, 0);
  for (glm::vec3& by : sum.displacement) by = glm::vec3(1, 2, 0);
  EXPECT_LT(consistency(first, second, &sum, scene.everywhere).largest, 1e-6);
  EXPECT_NEAR(consistency(first, second, &first, scene.everywhere).mean, 2, 1e-6);
  EXPECT_THROW(consistency(first, second, &sum, std::span(scene.everywhere).first(5)), InputError);
}

TEST(RegistrationScore, RefusesWhatDoesNotFit) {
  Scene scene;
  PullField other = scene.exact();
  other.grid.size.x -= 1;
  EXPECT_THROW(scene.score(other), InputError);
  scene.everywhere.assign(scene.everywhere.size(), Counts::no);
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
