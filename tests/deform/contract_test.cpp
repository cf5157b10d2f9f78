// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "deform/fields/formula.h"
#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Copies);

constexpr std::int64_t kCellSizes[] = {1, 2, 3, 4, 5, 8, 16};

/// Random bits; floating point with all that a copy may spoil: quiet NaN, infinities, -0, the smallest, all 53 bits.
template <class V>
Volume<V> random_volume(const Geometry& geometry, Random& random) {
  Volume<V> volume{geometry, std::vector<V>(static_cast<std::size_t>(voxel_count(geometry)))};
  using Limits = std::numeric_limits<V>;
  for (V& voxel : volume.voxels) {
    if constexpr (std::is_floating_point_v<V>) {
      voxel = static_cast<V>(random.real(-2000, 2000));
      if (random.chance(0.1)) {
        voxel = random.one_of<V>({Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), V(-0.0),
                                  Limits::denorm_min(), Limits::max(), Limits::lowest()});
      }
    } else {
      voxel = static_cast<V>(random.integer(Limits::lowest(), Limits::max()));
      if (random.chance(0.1)) voxel = random.one_of<V>({Limits::lowest(), Limits::max()});
    }
  }
  return volume;
}

template <class V>
void expect_identity(Resampler& resampler, const Volume<V>& source, Interpolation interpolation) {
  const Outcome<V> found = run(resampler, source, {.interpolation = interpolation});
  EXPECT_TRUE(same_bits(source.voxels, found.output.voxels)) << to_string(voxel_type_of<V>());
  EXPECT_EQ(found.report.covered, source.voxels.size());
  EXPECT_EQ(found.report.uncovered + found.report.clamped + found.report.padded + found.report.conflicts, 0u);
  EXPECT_EQ(found.report.inverted + found.report.degenerate + found.report.multiply_owned.value_or(1), 0u);
  EXPECT_EQ(found.report.jacobian_min, 1.0);
  EXPECT_EQ(found.report.jacobian_max, 1.0);
  for (std::size_t n = 0; n < source.voxels.size(); ++n) {
    ASSERT_EQ(found.coverage.voxels[n], 1);
    ASSERT_EQ(found.owners.voxels[n], 1);
    ASSERT_EQ(found.inverse_mm.voxels[n], glm::vec3(0));
    ASSERT_EQ(found.jacobian.voxels[n], 1.0f);
  }
}

TEST_P(Copies, DeterminantsAreTheSameWhetherOwnersAreCountedOrNot) {
  const Geometry grid = unit_grid({100, 70, 66});  // tiles at rest, and tiles that move
  const Bubble bubble{.radius = 20, .strength = 0.4, .centre = {30, 35, 33}};
  const Volume<std::int16_t> source{grid, std::vector<std::int16_t>(static_cast<std::size_t>(voxel_count(grid)), 3)};
  const auto resampler = make(grid);
  for (const std::int64_t cell : {1, 5}) {
    const VertexField field = sample_on(lattice_over(grid, cell), bubble);
    resampler->set_field(view(field));
    const auto expected = run(*resampler, source);
    auto found = poisoned<float>(grid);
    resampler->resample(whole(grid), {}, {.jacobian = view(found)});
    EXPECT_TRUE(same_bits(expected.jacobian.voxels, found.voxels)) << "cells of " << cell;
    EXPECT_GT(std::count(found.voxels.begin(), found.voxels.end(), 1.0f), 300000);
    EXPECT_LT(*std::min_element(found.voxels.begin(), found.voxels.end()), 0.95f);
  }
}

TEST_P(Copies, TheRangeOfDeterminantsIsThatOfTheMap) {
  // One cell, whose five tetrahedra all own voxels: cubes, plates, and plates turned in the grid.
  const std::uint64_t seed = test_seed();
  const Geometry grid = unit_grid({60, 60, 60});
  for (const glm::dvec3& edges : {glm::dvec3(20, 21, 19), {40, 40, 4}, {3, 44, 44}, {44, 44, 1.9}, {50, 2, 50}}) {
    for (std::uint64_t number = 0; number < 20; ++number) {
      SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
      Random random(seed, 50 + number);
      Geometry lattice = unit_grid({2, 2, 2});
      lattice.spacing = edges;
      if (number > 9)
        lattice.direction = rotation({random.real(-1, 1), random.real(-1, 1), random.real(-1, 1)}, random.real(0, 3));
      lattice.origin = glm::dvec3(30.0) - lattice.direction * (0.5 * edges);
      const VertexField field = field_in_voxels(grid, lattice, [&](const glm::dvec3&) {
        return 0.2 * std::min({edges.x, edges.y, edges.z}) *
               glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
      });
      const auto resampler = make(grid);
      resampler->set_field(view(field, Outside::background));
      Volume<float> jacobian{grid, std::vector<float>(static_cast<std::size_t>(voxel_count(grid)))};
      const Report report = resampler->resample(whole(grid), {}, {.jacobian = view(jacobian)});
      float least = INFINITY, most = -INFINITY;
      for (const float value : jacobian.voxels) {
        if (std::isnan(value)) continue;
        least = std::min(least, value);
        most = std::max(most, value);
      }
      EXPECT_EQ(report.jacobian_min, double{least}) << to_string(glm::i64vec3(edges));
      EXPECT_EQ(report.jacobian_max, double{most}) << to_string(glm::i64vec3(edges));
    }
  }
}

TEST_P(Copies, WhoeverDoesNotWantTheRangeOfDeterminantsGetsAllElseAsBefore) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < 40; ++number) {
    Random random(seed, 300 + number);
    const FieldCase test = number % 2 == 0 ? random_injective_case(random) : random_folding_case(random);
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number) + ": " + test.description);
    const auto source = random_volume<std::int16_t>(test.output, random);
    const auto resampler = make(test.output);
    resampler->set_field(view(test.field, Outside::background));
    const auto expected = run(*resampler, source);
    resampler->set_field(view(test.field, Outside::background), {.jacobian_range = false});
    const auto found = run(*resampler, source);
    Report without = expected.report;
    without.jacobian_min = INFINITY;
    without.jacobian_max = -INFINITY;
    expect_same_report(without, found.report);
    expect_same_outcome(expected, found);
    auto alone = poisoned<std::int16_t>(test.output);
    const Target target{.source = view(source), .output = view(alone), .background = -7};
    const Report of_it = resampler->resample(whole(test.output), {&target, 1});
    EXPECT_TRUE(same_bits(expected.output.voxels, alone.voxels)) << "without maps";
    EXPECT_EQ(of_it.inverted, expected.report.inverted);
    EXPECT_EQ(of_it.degenerate, expected.report.degenerate);
  }
}

TEST_P(Copies, IdentityReturnsTheSourceBitForBit) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  for (const Geometry& grid : {unit_grid({17, 9, 12}), oblique_grid({13, 18, 9})}) {
    const auto resampler = make(grid);
    for (const std::int64_t cell : kCellSizes) {
      SCOPED_TRACE("cells of " + std::to_string(cell));
      const VertexField field = uniform_field(lattice_over(grid, cell), glm::vec3(0));
      resampler->set_field(view(field));
      for (const Interpolation interpolation : kInterpolations) {
        for (int type = 0; type < 8; ++type) {
          dispatch(static_cast<VoxelType>(type), [&](auto voxel) {
            expect_identity(*resampler, random_volume<decltype(voxel)>(grid, random), interpolation);
          });
        }
      }
    }
  }
}

TEST_P(Copies, ThinVolumesOfTwoVoxelsAreCopied) {
  Random random(1);
  for (const glm::i64vec3& size : {glm::i64vec3(2, 2, 2), glm::i64vec3(2, 7, 3), glm::i64vec3(40, 2, 2)}) {
    const Geometry grid = oblique_grid(size);
    const auto resampler = make(grid);
    for (const std::int64_t cell : kCellSizes) {
      const VertexField field = uniform_field(lattice_over(grid, cell), glm::vec3(0));
      resampler->set_field(view(field));
      expect_identity(*resampler, random_volume<std::int16_t>(grid, random), Interpolation::linear);
    }
  }
}

/// The source moved by whole voxels, the background where nothing comes from.
template <class V>
Volume<V> shifted(const Volume<V>& source, const glm::i64vec3& shift, V background) {
  Volume<V> result{source.geometry, {}};
  for_each_voxel(source.geometry, [&](const glm::i64vec3& voxel, std::size_t) {
    const glm::i64vec3 from = voxel - shift;
    result.voxels.push_back(is_voxel(source.geometry, from) ? source.voxels[offset_of(source.geometry, from)]
                                                            : background);
  });
  return result;
}

TEST_P(Copies, WholeShiftsUnderHalfTheVolumeAreShiftedCopies) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const glm::i64vec3 shifts[] = {{1, 0, 0}, {0, -2, 0}, {0, 0, 3}, {-5, 3, 2}, {6, -4, -3}, {-7, -5, 4}};
  for (const Geometry& grid : {unit_grid({17, 13, 10}), oblique_grid({16, 12, 11})}) {
    const auto resampler = make(grid);
    const Volume<std::int16_t> integers = random_volume<std::int16_t>(grid, random);
    const Volume<double> reals = random_volume<double>(grid, random);
    for (const std::int64_t cell : kCellSizes) {
      for (const glm::i64vec3& shift : shifts) {
        SCOPED_TRACE("cells of " + std::to_string(cell) + ", shift " + to_string(shift));
        const glm::vec3 mm(point_from_index(grid).linear * glm::dvec3(shift));
        const VertexField field = uniform_field(lattice_over(grid, cell), mm);
        resampler->set_field(view(field));
        for (const Interpolation interpolation : kInterpolations) {
          const Options options{.interpolation = interpolation};
          const auto expected = shifted<std::int16_t>(integers, shift, -7);
          EXPECT_TRUE(same_bits(expected.voxels, run(*resampler, integers, options).output.voxels));
          EXPECT_TRUE(same_bits(shifted(reals, shift, -7.0).voxels, run(*resampler, reals, options).output.voxels));
        }
      }
    }
  }
}

/// The field that turns a volume by right angles about its middle: axis a of the source becomes axis `to[a]`, reversed
/// where `sign[a]` is -1.
struct Turn {
  int to[3];
  int sign[3];

  glm::dvec3 operator()(const glm::dvec3& x, const glm::dvec3& middle) const {
    glm::dvec3 turned;
    for (int axis = 0; axis < 3; ++axis) turned[to[axis]] = middle[to[axis]] + sign[axis] * (x[axis] - middle[axis]);
    return turned;
  }
};

TEST_P(Copies, QuarterTurnsAndMirrorsAreExactCopies) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Turn turns[] = {{{1, 0, 2}, {1, -1, 1}}, {{1, 0, 2}, {-1, 1, 1}},  {{0, 2, 1}, {1, 1, -1}},
                        {{2, 1, 0}, {-1, 1, 1}}, {{0, 1, 2}, {-1, -1, 1}}, {{0, 1, 2}, {-1, 1, 1}},
                        {{1, 2, 0}, {1, 1, 1}},  {{1, 0, 2}, {1, 1, 1}}};
  for (const std::int64_t size : {9, 12}) {  // the middle on a voxel, and between two
    const Geometry grid = unit_grid(glm::i64vec3(size));
    const glm::dvec3 middle = 0.5 * glm::dvec3(grid.size - std::int64_t{1});
    const Volume<std::int16_t> source = random_volume<std::int16_t>(grid, random);
    const auto resampler = make(grid);
    for (const std::int64_t cell : kCellSizes) {
      for (const Turn& turn : turns) {
        SCOPED_TRACE("size " + std::to_string(size) + ", cells of " + std::to_string(cell));
        const VertexField field =
            field_in_voxels(grid, lattice_over(grid, cell), [&](const glm::dvec3& x) { return turn(x, middle) - x; });
        resampler->set_field(view(field));
        Volume<std::int16_t> expected = source;
        for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
          expected.voxels[offset_of(grid, glm::i64vec3(turn(glm::dvec3(voxel), middle)))] = source.voxels[n];
        });
        for (const Interpolation interpolation : kInterpolations) {
          const auto found = run(*resampler, source, {.interpolation = interpolation});
          EXPECT_TRUE(same_bits(expected.voxels, found.output.voxels));
          EXPECT_EQ(found.report.covered, source.voxels.size());
        }
      }
    }
  }
}

TEST_P(Copies, SeveralVolumesGoThroughOneFieldAsEachAlone) {
  Random random(5);
  const Geometry grid = unit_grid({11, 12, 9});
  const auto resampler = make(grid);
  const VertexField field = field_in_voxels(grid, lattice_over(grid, 2), [&](const glm::dvec3&) {
    return 1.5 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
  resampler->set_field(view(field));
  const Volume<std::int16_t> ct = random_volume<std::int16_t>(grid, random);
  const Volume<std::uint8_t> labels = random_volume<std::uint8_t>(grid, random);
  Outcome<std::int16_t> both = poisoned_outcome<std::int16_t>(grid);
  Volume<std::uint8_t> both_labels = poisoned<std::uint8_t>(grid);
  const Target targets[] = {
      {.source = view(ct), .output = view(both.output), .background = -1000},
      {.source = view(labels), .output = view(both_labels), .interpolation = Interpolation::nearest, .background = 3}};
  both.report = resampler->resample(whole(grid), targets, maps_of(both));
  const auto ct_alone = run(*resampler, ct, {.background = -1000});
  const auto labels_alone = run(*resampler, labels, {.interpolation = Interpolation::nearest, .background = 3});
  expect_same_outcome(ct_alone, both);
  expect_same_report(ct_alone.report, both.report);
  EXPECT_TRUE(same_bits(labels_alone.output.voxels, both_labels.voxels));
}

TEST_P(Copies, TheShortFormTakesTheSmallestValueAsBackground) {
  const Geometry grid = unit_grid({6, 5, 4});
  Volume<std::int16_t> source{grid, {}};
  for_each_voxel(
      grid, [&](const glm::i64vec3&, std::size_t n) { source.voxels.push_back(static_cast<std::int16_t>(n - 50)); });
  const VertexField field = uniform_field(lattice_over(grid, 1), {2, 0, 0});
  const auto resampler = make(grid);
  Report report;
  const Volume<std::int16_t> found = resample(*resampler, source, field, &report);
  EXPECT_TRUE(same_bits(shifted<std::int16_t>(source, {2, 0, 0}, -50).voxels, found.voxels));
  EXPECT_EQ(report.covered, 80u);
  EXPECT_EQ(report.uncovered, 40u);
}

}  // namespace
}  // namespace tetwarp
