// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>

#include "deform/field_check.h"
#include "tests/support/backends.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

class Pull : public BackendTest {
 protected:
  void SetUp() override {
    BackendTest::SetUp();
    if (!IsSkipped() && !GetParam().make_pull) GTEST_SKIP() << GetParam().name << " has no pull fields";
  }
  std::unique_ptr<PullResampler> make_pull(const Geometry& output, int threads = 0) const {
    return GetParam().make_pull(output, Limits{.threads = threads});
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, Pull, testing::ValuesIn(backends()), backend_name);

PullField uniform_pull(const Geometry& grid, const glm::dvec3& mm) {
  return {grid, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(grid)), glm::vec3(mm))};
}

TEST_P(Pull, AGridThatEndsWithinRoundingOfTheOutermostVoxelsLosesNone) {
  const Geometry grid = unit_grid({12, 11, 10});
  Random random(test_seed(), 66);
  const auto source = random_values<float>(grid, random, -1000, 1000);
  for (int end = 0; end < 6; ++end) {
    SCOPED_TRACE(end);
    const int axis = end % 3;
    // A grid from one border to the other, but for an end that is short by part of a sample's distance.
    const auto shorter_by = [&](double part) {
      Geometry samples = grid;
      samples.size = {4, 5, 4};
      samples.spacing = glm::dvec3(grid.size - std::int64_t{1}) / glm::dvec3(samples.size - std::int64_t{1});
      const double shorter = part * samples.spacing[axis];
      samples.spacing[axis] -= shorter / static_cast<double>(samples.size[axis] - 1);
      if (end < 3) samples.origin[axis] += shorter;
      return PullField{samples, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(samples)))};
    };
    const PullField field = shorter_by(0.9 / 256), too_short = shorter_by(1.1 / 256);
    const auto resampler = make_pull(grid);
    for (const Outside outside : {Outside::refuse, Outside::background}) {
      resampler->set_field(view(field, outside));
      Volume<float> output{grid, std::vector<float>(source.voxels.size())};
      const Target target{.source = view(source), .output = view(output), .background = -7};
      EXPECT_EQ(resampler->resample(whole(grid), {&target, 1}).covered, source.voxels.size());
      EXPECT_EQ(output.voxels, source.voxels);
    }
    EXPECT_THROW(resampler->set_field(view(too_short)), InputError);
  }
}

TEST_P(Pull, WholeShiftsCopyExactly) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  for (const Geometry& grid : {unit_grid({14, 11, 9}), oblique_grid({12, 13, 10})}) {
    const auto resampler = make_pull(grid);
    for (const glm::i64vec3& shift : {glm::i64vec3(0), glm::i64vec3(3, 0, -2), glm::i64vec3(-5, 4, 1)}) {
      const PullField field = uniform_pull(grid, point_from_index(grid).linear * glm::dvec3(shift));
      resampler->set_field(view(field));
      for (int type = 0; type < 8; ++type) {
        dispatch(static_cast<VoxelType>(type), [&](auto voxel) {
          using V = decltype(voxel);
          const auto source = random_values<V>(grid, random, 0, 120);
          const auto found = run(*resampler, source, {.background = 3, .pull = true});
          std::uint64_t covered = 0;
          for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t n) {
            const bool inside = is_voxel(grid, v + shift);
            ASSERT_EQ(found.output.voxels[n], inside ? source.voxels[offset_of(grid, v + shift)] : V(3));
            ASSERT_EQ(found.coverage.voxels[n], inside);
            covered += inside;
          });
          EXPECT_EQ(found.report.covered, covered);
          EXPECT_EQ(found.report.uncovered, source.voxels.size() - covered);
        });
      }
    }
  }
}

/// Displacement of a pull field at a place of its grid, mm: eight products of weights, in double.
glm::dvec3 trilinear(const PullField& field, const glm::dvec3& index) {
  glm::dvec3 sum(0);
  const glm::dvec3 base = glm::min(glm::floor(index), glm::dvec3(field.grid.size - std::int64_t{2}));
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 step(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 t = glm::abs(1.0 - step - (index - base));
    sum += t.x * t.y * t.z * glm::dvec3(field.displacement[offset_of(field.grid, glm::i64vec3(base + step))]);
  }
  return sum;
}

struct PullCase {
  Geometry output = oblique_grid({13, 12, 11});
  PullField field;
  Volume<float> source;

  /// A coarse, turned grid of samples whose box, widened by `margin` mm, holds the output's.
  explicit PullCase(Random& random, double half_mm) {
    field.grid.size = {6, 7, 5};
    field.grid.direction = rotation({0.2, -1, 0.4}, 0.7);
    field.grid.spacing = 2 * half_mm / glm::dvec3(field.grid.size - std::int64_t{1});
    field.grid.origin = centre(output) - field.grid.direction * glm::dvec3(half_mm);
    for (std::int64_t n = 0; n < voxel_count(field.grid); ++n) {
      field.displacement.emplace_back(random.real(-2, 2), random.real(-2, 2), random.real(-2, 2));
    }
    source = random_values<float>(output, random, 0, 1);
  }
};

TEST_P(Pull, DisplacementIsTrilinearBetweenSamples) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const PullCase test(random, 15);
  const auto resampler = make_pull(test.output);
  resampler->set_field(view(test.field));
  const AffineMap sample = index_from_point(test.field.grid) * point_from_index(test.output);
  const glm::dmat3 voxels = index_from_point(test.output).linear;
  for (const Interpolation interpolation : kInterpolations) {
    const auto found = run(*resampler, test.source, {.interpolation = interpolation, .pull = true});
    for_each_voxel(test.output, [&](const glm::i64vec3& voxel, std::size_t n) {
      const glm::dvec3 mm = trilinear(test.field, sample(glm::dvec3(voxel)));
      ASSERT_LE(glm::length(glm::dvec3(found.inverse_mm.voxels[n]) - mm), 4e-4) << to_string(voxel);
      const auto expected = reference_sample(test.source, glm::dvec3(voxel) + voxels * mm, interpolation);
      if (expected.jump < 1e-3) return;
      ASSERT_EQ(found.coverage.voxels[n], expected.inside);
      ASSERT_NEAR(found.output.voxels[n], expected.inside ? expected.value : -7, 2e-3) << to_string(voxel);
    });
  }
}

/// A grid of samples over a unit grid, its vectors at random, one in fifty missing.
PullField random_pull(Random& random, const glm::i64vec3& size, double spacing, double origin) {
  PullField field{{.size = size, .spacing = glm::dvec3(spacing), .origin = glm::dvec3(origin)}, {}};
  for (std::int64_t n = 0; n < voxel_count(field.grid); ++n) {
    const bool missing = random.real(0, 1) < 0.02;
    field.displacement.emplace_back(missing ? NAN : random.real(-2, 2), random.real(-2, 2), random.real(-2, 2));
  }
  return field;
}

/// Where a voxel comes from by the eight samples around it, none of them shared with another voxel.
bool offset_of_voxel(const PullFrame& frame, const glm::i64vec3& voxel, glm::vec3& offset) {
  const auto sample = [&](const glm::i64vec3& at) { return frame.sample(at); };
  glm::dvec3 index = frame.grid_from_output(glm::dvec3(voxel));
  if (!frame.clamp_to_samples(index)) return false;
  glm::dvec3 found = frame.trilinear<false>(index, sample);
  if (PullFrame::is_missing(found)) found = frame.trilinear<true>(index, sample);
  offset = glm::vec3(found);
  return !PullFrame::is_missing(found);
}

TEST_P(Pull, OnWhateverGridTheSamplesLieEachVoxelHasTheBitsOfItsOwnEight) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry output = unit_grid({70, 11, 9});
  constexpr double kInSlack = 1.0 / 8192;  // of a sample
  std::uint64_t unmapped = 0;              // a coarse field may have no hole
  struct Case {
    double spacing, origin;
  };
  for (const Case& of : {Case{1, 0}, Case{1, 0.25}, Case{4, -1}, Case{4, kInSlack}, Case{2.5, -0.3}, Case{3, 2},
                         Case{0.5, -1}, Case{1.5, 0}, Case{7, 0}}) {
    const glm::i64vec3 size = glm::i64vec3(glm::ceil(glm::dvec3(66, 11, 8) / of.spacing)) + std::int64_t{1};
    const PullField field = random_pull(random, size, of.spacing, of.origin);
    const auto resampler = make_pull(output);
    resampler->set_field(view(field, Outside::background));
    const auto source = random_values<std::int16_t>(output, random, 0, 100);
    const auto found = run(*resampler, source, {.pull = true});
    const PullFrame frame = make_pull_frame(output, view(field, Outside::background));
    std::uint64_t mapped = 0;
    for_each_voxel(output, [&](const glm::i64vec3& voxel, std::size_t n) {
      glm::vec3 expected(0);
      const bool comes = offset_of_voxel(frame, voxel, expected);
      const glm::vec3 vector(found.inverse_mm.voxels[n]);
      ASSERT_EQ(!std::isnan(vector.x), comes) << of.spacing << ", " << of.origin << ": " << to_string(voxel);
      mapped += comes;
      ASSERT_TRUE(!comes || vector == expected) << of.spacing << ", " << of.origin << ": " << to_string(voxel);
    });
    EXPECT_GT(mapped, 3000u) << of.spacing << ", " << of.origin;
    unmapped += found.inverse_mm.voxels.size() - mapped;
  }
  EXPECT_GT(unmapped, 0u);
}

TEST_P(Pull, OutsideItsGridVoxelsRestOrGetTheBackgroundOrAreRefused) {
  Random random(8);
  const PullCase test(random, 4);
  const auto resampler = make_pull(test.output);
  EXPECT_THROW(resampler->set_field(view(test.field)), InputError);
  const AffineMap sample = index_from_point(test.field.grid) * point_from_index(test.output);
  const glm::dvec3 last(test.field.grid.size - std::int64_t{1});
  for (const Outside outside : {Outside::rest, Outside::background}) {
    resampler->set_field(view(test.field, outside));
    const auto found = run(*resampler, test.source, {.pull = true});
    int outsiders = 0;
    for_each_voxel(test.output, [&](const glm::i64vec3& voxel, std::size_t n) {
      const glm::dvec3 at = sample(glm::dvec3(voxel)), room = glm::min(at, last - at);
      if (std::min({room.x, room.y, room.z}) > -1.0 / 256 - 1e-6) return;
      ++outsiders;
      const bool rest = outside == Outside::rest;
      ASSERT_EQ(found.coverage.voxels[n], rest);
      ASSERT_EQ(found.output.voxels[n], rest ? test.source.voxels[n] : -7);
      ASSERT_EQ(found.inverse_mm.voxels[n] == glm::vec3(0), rest);
      ASSERT_EQ(std::isnan(found.inverse_mm.voxels[n].x), !rest);
    });
    EXPECT_GT(outsiders, 100);
    EXPECT_LT(outsiders, 1600);
  }
}

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Whether a sample around a place is missing, further than 2^-12 of the way from the others on each axis.
bool is_missing(const PullField& field, const glm::dvec3& index) {
  const glm::dvec3 base = glm::min(glm::floor(index), glm::dvec3(field.grid.size - std::int64_t{2}));
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 step(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 t = glm::abs(1.0 - step - (index - base));
    const glm::vec3& mm = field.displacement[offset_of(field.grid, glm::i64vec3(base + step))];
    if (std::isnan(mm.x + mm.y + mm.z) && std::min({t.x, t.y, t.z}) > 1.0 / 4096) return true;
  }
  return false;
}

/// Takes a part of the samples away: one of three components is enough.
void punch(PullField& field, double part, Random& random) {
  for (glm::vec3& mm : field.displacement) {
    if (random.chance(part)) mm[static_cast<int>(random.integer(0, 2))] = kNaN;
  }
}

TEST_P(Pull, AVoxelBesideAMissingSampleIsNotCovered) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  PullCase test(random, 15);
  test.field = {test.field.grid, {}};
  test.field.grid.spacing *= glm::dvec3(test.field.grid.size - std::int64_t{1}) / 14.0;
  test.field.grid.size = glm::i64vec3(15);
  for (int n = 0; n < 15 * 15 * 15; ++n)
    test.field.displacement.emplace_back(random.real(-2, 2), random.real(-2, 2), random.real(-2, 2));
  const auto resampler = make_pull(test.output);
  resampler->set_field(view(test.field));
  const auto all = run(*resampler, test.source, {.pull = true});
  punch(test.field, 0.1, random);
  const AffineMap sample = index_from_point(test.field.grid) * point_from_index(test.output);
  for (const Outside outside : {Outside::refuse, Outside::rest, Outside::background}) {
    resampler->set_field(view(test.field, outside));
    const auto found = run(*resampler, test.source, {.pull = true});
    std::uint64_t missing = 0, covered = 0;
    for_each_voxel(test.output, [&](const glm::i64vec3& voxel, std::size_t n) {
      const bool none = is_missing(test.field, sample(glm::dvec3(voxel)));
      missing += none;
      covered += found.coverage.voxels[n];
      ASSERT_EQ(found.coverage.voxels[n], none ? 0 : all.coverage.voxels[n]) << to_string(voxel);
      // 2^-12 of the way to another sample, up to 6 voxels elsewhere.
      ASSERT_NEAR(found.output.voxels[n], none ? -7 : all.output.voxels[n], none ? 0 : 5e-3) << to_string(voxel);
      ASSERT_EQ(std::isnan(found.inverse_mm.voxels[n].x), none) << to_string(voxel);
    });
    EXPECT_GT(missing, 100U);
    EXPECT_GT(covered, 100U);
    EXPECT_EQ(found.report.covered, covered);
    EXPECT_EQ(found.report.uncovered, found.output.voxels.size() - covered);
  }
}

TEST_P(Pull, WhereSamplesLieOnVoxelsMissingOnesTakeTheirOwnAlone) {
  Random random(9);
  const Geometry grid = oblique_grid({9, 8, 7});
  const auto source = random_values<float>(grid, random, 0, 1);
  PullField field = uniform_pull(grid, glm::dvec3(0));
  punch(field, 0.3, random);
  const auto resampler = make_pull(grid);
  resampler->set_field(view(field));
  const auto found = run(*resampler, source, {.pull = true});
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    const glm::vec3& mm = field.displacement[n];
    const bool missing = std::isnan(mm.x + mm.y + mm.z);
    ASSERT_EQ(found.coverage.voxels[n], !missing) << to_string(voxel);
    ASSERT_EQ(found.output.voxels[n], missing ? -7 : source.voxels[n]) << to_string(voxel);
  });
}

TEST_P(Pull, AFieldWithoutAnySampleLeavesTheBackground) {
  const Geometry grid = unit_grid({6, 5, 4});
  Random random(10);
  const auto source = random_values<float>(grid, random, 0, 1);
  const PullField none{grid, std::vector<glm::vec3>(120, glm::vec3(kNaN))};
  const auto resampler = make_pull(grid);
  resampler->set_field(view(none, Outside::rest));
  const auto found = run(*resampler, source, {.pull = true});
  EXPECT_EQ(found.report.uncovered, 120U);
  EXPECT_TRUE(same_bits(found.output.voxels, std::vector<float>(120, -7)));
}

TEST_P(Pull, AnInverseThatAForwardFieldLeftDeformsLikeIt) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < 60 && !HasFailure(); ++number) {
    Random random(seed, number);
    const FieldCase test = random_injective_case(random);
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number) + ": " + test.description);
    Volume<float> ramp{test.output, {}};
    for_each_voxel(test.output, [&](const glm::i64vec3& v, std::size_t) {
      ramp.voxels.push_back(static_cast<float>(v.x + 3 * v.y - 2 * v.z));
    });
    const auto forward = make(test.output);
    const auto pull = make_pull(test.output);
    forward->set_field(view(test.field));
    const auto expected = run(*forward, ramp);
    PullField inverse{test.output, expected.inverse_mm.voxels};
    pull->set_field(view(inverse));
    const auto found = run(*pull, ramp, {.pull = true});
    for_each_voxel(test.output, [&](const glm::i64vec3& voxel, std::size_t n) {
      ASSERT_EQ(std::isnan(found.inverse_mm.voxels[n].x), expected.owners.voxels[n] == 0) << to_string(voxel);
      const glm::dvec3 x0 =
          glm::dvec3(voxel) + index_from_point(test.output).linear * glm::dvec3(expected.inverse_mm.voxels[n]);
      if (expected.owners.voxels[n] != 0 && reference_sample(ramp, x0, Interpolation::linear).jump < 1e-3) return;
      ASSERT_EQ(found.coverage.voxels[n], expected.coverage.voxels[n]) << to_string(voxel);
      ASSERT_NEAR(found.output.voxels[n], expected.output.voxels[n], 1e-3) << to_string(voxel);
    });
  }
}

TEST_P(Pull, ThreadsAndRegionsChangeNothing) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  PullCase test(random, 30);
  punch(test.field, 0.1, random);
  test.output.size = {41, 35, 39};
  test.source = random_values<float>(test.output, random, 0, 1);
  const auto one = make_pull(test.output, 1), two = make_pull(test.output, 2);
  one->set_field(view(test.field, Outside::rest));
  two->set_field(view(test.field, Outside::rest));
  const auto expected = run(*one, test.source, {.pull = true});
  const auto found = run(*two, test.source, {.pull = true});
  expect_same_outcome(expected, found);
  expect_same_report(expected.report, found.report);
  const Region part{{3, 30, 7}, {40, 35, 38}}, needed = two->source_region(test.output, part);
  std::vector<float> source, output(static_cast<std::size_t>(voxel_count(part)));
  const auto for_each_in = [](const Region& region, auto&& visit) {
    for (std::int64_t k = region.begin.z; k < region.end.z; ++k) {
      for (std::int64_t j = region.begin.y; j < region.end.y; ++j) {
        for (std::int64_t i = region.begin.x; i < region.end.x; ++i) visit(glm::i64vec3(i, j, k));
      }
    }
  };
  for_each_in(needed, [&](const glm::i64vec3& v) { source.push_back(test.source.voxels[offset_of(test.output, v)]); });
  const Target target{
      .source = {&test.output, needed, VoxelType::f32, 1, reinterpret_cast<const std::byte*>(source.data())},
      .output = {&test.output, part, VoxelType::f32, 1, reinterpret_cast<std::byte*>(output.data())},
      .background = -7};
  two->resample(part, {&target, 1});
  std::size_t n = 0;
  for_each_in(part, [&](const glm::i64vec3& v) {
    ASSERT_EQ(output[n++], expected.output.voxels[offset_of(test.output, v)]) << to_string(v);
  });
}

/// Whether a resampler can be given a field.
template <class OneResampler, class Field>
concept Takes = requires(OneResampler& resampler, const Field& field) {
  resampler.set_field(field);
};
/// Whether `resample` sends volumes through a field by a resampler.
template <class OneResampler, class Field>
concept Sends = requires(OneResampler& resampler, const Volume<float>& source, const Field& field) {
  resample(resampler, source, field);
};

// Directions are never mistaken: the wrong one does not compile.
static_assert(Takes<ForwardResampler, FieldView>);
static_assert(!Takes<ForwardResampler, PullFieldView>);
static_assert(Takes<PullResampler, PullFieldView>);
static_assert(!Takes<PullResampler, FieldView>);
static_assert(!Takes<Resampler, FieldView> && !Takes<Resampler, PullFieldView>);
static_assert(Sends<ForwardResampler, VertexField>);
static_assert(!Sends<ForwardResampler, PullField> && !Sends<PullResampler, VertexField>);
static_assert(!std::is_convertible_v<PullFieldView, FieldView> && !std::is_convertible_v<FieldView, PullFieldView>);
static_assert(!std::is_convertible_v<PullField, VertexField> && !std::is_convertible_v<VertexField, PullField>);

TEST_P(Pull, FieldsThatAreNotFiniteAreRefused) {
  const Geometry grid = unit_grid({5, 5, 5});
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  for (const float bad : {kInfinite, -kInfinite, 1e30f}) {
    PullField pull = uniform_pull(grid, glm::dvec3(0));
    pull.displacement[77].y = bad;
    EXPECT_THROW(make_pull(grid)->set_field(view(pull)), InputError);
  }
  PullField both = uniform_pull(grid, glm::dvec3(0));
  both.displacement[77] = {kNaN, 0, kInfinite};
  EXPECT_THROW(make_pull(grid)->set_field(view(both)), InputError);
  PullField few = uniform_pull(grid, glm::dvec3(0));
  few.displacement.pop_back();
  EXPECT_THROW(view(few), InputError);
}

}  // namespace
}  // namespace tetwarp
