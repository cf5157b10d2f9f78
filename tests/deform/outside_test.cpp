// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>

#include "tests/support/backends.h"
#include "tests/support/oracle.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(OutsideTheLattice);

/// A lattice over the box from `low` to `high`, output index.
Geometry lattice_between(const Geometry& grid, const glm::dvec3& low, const glm::dvec3& high, std::int64_t cells) {
  Geometry lattice = grid;
  lattice.size = glm::i64vec3(cells + 1);
  lattice.origin = point_from_index(grid)(low);
  lattice.spacing = grid.spacing * (high - low) / static_cast<double>(cells);
  return lattice;
}

/// Vertices thrown about by up to `inner` voxels, those of the border by up to `border`.
VertexField shaken(const Geometry& grid, const Geometry& lattice, Random& random, double inner, double border) {
  const AffineMap vertex = index_from_point(lattice) * point_from_index(grid);
  return field_in_voxels(grid, lattice, [&](const glm::dvec3& at) {
    const glm::dvec3 v = glm::round(vertex(at)), last(lattice.size - std::int64_t{1});
    const bool inside = glm::all(glm::lessThan(glm::dvec3(0), v)) && glm::all(glm::lessThan(v, last));
    const double amplitude = inside ? inner : border;
    return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
}

TEST_P(OutsideTheLattice, RefuseAcceptsLatticesMadeOverTheVolume) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  for (int number = 0; number < 300; ++number) {
    Geometry grid = unit_grid({random.integer(2, 40), random.integer(2, 40), random.integer(2, 40)});
    grid.spacing = {random.real(0.1, 3), random.real(0.1, 3), random.real(0.1, 3)};
    grid.origin = {random.real(-500, 500), random.real(-500, 500), random.real(-2000, 500)};
    grid.direction = rotation({random.real(-1, 1), random.real(-1, 1), 1}, random.real(-3, 3));
    const VertexField field = uniform_field(lattice_over(grid, random.integer(1, 9)), glm::vec3(0));
    EXPECT_NO_THROW(make(grid)->set_field(view(field)));
  }
}

/// Only the volume is made, no maps, for then whole tiles at rest may be copied.
TEST_P(OutsideTheLattice, PlacesThatTheLatticeHasLeftAreBackground) {
  const Geometry grid = unit_grid({130, 70, 70});
  for (const std::int64_t cell_size : {1, 8, 16}) {
    SCOPED_TRACE("cells of " + std::to_string(cell_size));
    const VertexField field =
        field_in_voxels(grid, lattice_over(grid, cell_size), [](const glm::dvec3&) { return glm::dvec3(89.5, 0, 0); });
    Volume<std::int16_t> source{grid, std::vector<std::int16_t>(static_cast<std::size_t>(voxel_count(grid)), 100)};
    Volume<std::int16_t> output = poisoned<std::int16_t>(grid);
    const auto resampler = make(grid);
    resampler->set_field(view(field, Outside::background));
    const Target target{.source = view(source), .output = view(output), .background = -7};
    resampler->resample(whole(grid), {&target, 1}, {});
    for (std::size_t n = 0; n < output.voxels.size(); ++n)
      ASSERT_EQ(output.voxels[n], n % 130 < 90 ? -7 : 100) << "voxel " << n;
  }
}

TEST_P(OutsideTheLattice, RefuseThrowsWhereABorderLiesInside) {
  const Geometry grid = oblique_grid({10, 11, 12});
  const glm::dvec3 last(grid.size - std::int64_t{1});
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool upper : {false, true}) {
      glm::dvec3 low(0), high(last);
      (upper ? high : low)[axis] += upper ? -0.01 : 0.01;
      const VertexField field = uniform_field(lattice_between(grid, low, high, 3), glm::vec3(0));
      const auto resampler = make(grid);
      EXPECT_THROW(resampler->set_field(view(field)), InputError);
      EXPECT_NO_THROW(resampler->set_field(view(field, Outside::rest)));
      EXPECT_NO_THROW(resampler->set_field(view(field, Outside::background)));
    }
  }
}

TEST_P(OutsideTheLattice, ABorderWithinRoundingOfTheOutermostVoxelsLosesNone) {
  for (const Geometry& grid : {unit_grid({10, 11, 12}), oblique_grid({10, 11, 12})}) {
    const glm::dvec3 last(grid.size - std::int64_t{1});
    Random random(test_seed(), 77);
    const auto source = random_values<float>(grid, random, -1000, 1000);
    for (const double steps : {0.3, 0.5, 0.6, 0.9, 1.0, 1.1, 5.0, 15.9, 16.1, 30.0}) {  // steps of 2^-12 voxel
      SCOPED_TRACE(steps);
      for (int end = 0; end < 6; ++end) {
        glm::dvec3 low(0), high(last);
        (end < 3 ? low : high)[end % 3] += (end < 3 ? steps : -steps) / 4096;
        const VertexField field = uniform_field(lattice_between(grid, low, high, 3), glm::vec3(0));
        const auto resampler = make(grid);
        const bool within = steps < 16;
        if (!within) {
          EXPECT_THROW(resampler->set_field(view(field)), InputError);
          resampler->set_field(view(field, Outside::background));  // what ends there stays as it is
          EXPECT_LT(run(*resampler, source).report.covered, source.voxels.size());
          continue;
        }
        for (const Outside outside : {Outside::refuse, Outside::rest, Outside::background}) {
          resampler->set_field(view(field, outside));
          const auto found = run(*resampler, source);
          EXPECT_EQ(found.report.covered, source.voxels.size());
          EXPECT_EQ(found.output.voxels, source.voxels);
          EXPECT_EQ(found.owners.voxels, std::vector<std::uint16_t>(source.voxels.size(), 1));
        }
      }
    }
  }
}

TEST_P(OutsideTheLattice, ALatticeTurnedInItsGridLosesNoVoxelOfItsBorder) {
  // A layer of vertices along a tilted plane through the outermost voxels: each is snapped beside the plane. Few of
  // these planes come to lie so far inside that a voxel of theirs would be lost, so that it takes many.
  const Geometry grid = unit_grid({8, 7, 6});
  Random random(test_seed(), 78);
  const auto source = random_values<float>(grid, random, -1000, 1000);
  const glm::dvec3 last(grid.size - std::int64_t{1});
  for (int number = 0; number < 800; ++number) {
    SCOPED_TRACE(number);
    glm::dvec3 axis(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    if (number % 4 == 0) axis = {1, 0, 0};  // whole edges of the volume lie in the border, not single corners
    const glm::dmat3 turn = rotation(axis, random.real(0.05, 1));
    glm::dvec3 low(INFINITY), high(-INFINITY);
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 at = glm::transpose(turn) * (glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * last);
      low = glm::min(low, at);
      high = glm::max(high, at);
    }
    Geometry lattice;
    lattice.size = {6, 5, 4};
    lattice.spacing = (high - low) / glm::dvec3(lattice.size - std::int64_t{1});
    lattice.direction = turn;
    lattice.origin = turn * low;
    const VertexField field = uniform_field(lattice, glm::vec3(0));
    const auto resampler = make(grid);
    resampler->set_field(view(field));
    const auto found = run(*resampler, source);
    EXPECT_EQ(found.report.covered, source.voxels.size());
    EXPECT_EQ(found.output.voxels, source.voxels);
  }
}

TEST_P(OutsideTheLattice, RestKeepsTheSourceRoundAFieldWhoseBorderRests) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < 30; ++number) {
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number));
    Random random(seed, number);
    const Geometry grid = random.chance(0.5) ? unit_grid({14, 13, 12}) : oblique_grid({14, 13, 12});
    const glm::dvec3 low =
        glm::round(4.0 * glm::dvec3(random.real(-0.2, 1), random.real(0, 1), random.real(0, 1))) * 1.25;
    const Geometry lattice = lattice_between(grid, low, low + 6.5, 4);
    const VertexField field = shaken(grid, lattice, random, 0.3, 0);
    const auto source = random_values<float>(grid, random, -1000, 1000);
    const auto resampler = make(grid);
    resampler->set_field(view(field, Outside::rest));
    const auto found = run(*resampler, source);
    const Oracle oracle(grid, field);
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      const glm::dvec3 p(voxel);
      const bool inside = glm::all(glm::lessThanEqual(low, p)) && glm::all(glm::lessThanEqual(p, low + 6.5));
      ASSERT_EQ(found.owners.voxels[n], inside ? 1 : 0) << to_string(voxel);
      ASSERT_EQ(found.owners.voxels[n], oracle.owners(voxel).count) << to_string(voxel);
      ASSERT_EQ(found.coverage.voxels[n], 1);
      if (inside) return;
      ASSERT_EQ(found.output.voxels[n], source.voxels[n]) << to_string(voxel);
      ASSERT_EQ(found.inverse_mm.voxels[n], glm::vec3(0));
      ASSERT_EQ(found.jacobian.voxels[n], 1.0f);
    });
    EXPECT_EQ(found.report.conflicts, 0u);
    EXPECT_EQ(found.report.covered, source.voxels.size());
  }
}

TEST_P(OutsideTheLattice, RestCountsTheVoxelsThatAMovedBorderReaches) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < 30; ++number) {
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number));
    Random random(seed, 100 + number);
    const Geometry grid = unit_grid({14, 13, 12});
    const glm::dvec3 low(3.5, 3, 2.25), high(9.5, 9, 8.5);
    const VertexField field = shaken(grid, lattice_between(grid, low, high, 3), random, 1, 2);
    const auto source = random_values<float>(grid, random, -1000, 1000);
    const auto resampler = make(grid);
    resampler->set_field(view(field, Outside::rest));
    const auto found = run(*resampler, source);
    const Oracle oracle(grid, field);
    std::uint64_t conflicts = 0, uncovered = 0;
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      const glm::dvec3 p(voxel);
      const bool inside = glm::all(glm::lessThanEqual(low, p)) && glm::all(glm::lessThanEqual(p, high));
      const bool owned = oracle.owners(voxel).count > 0;
      conflicts += owned && !inside;
      uncovered += !owned && inside;
      ASSERT_EQ(found.coverage.voxels[n], owned || !inside) << to_string(voxel);
      ASSERT_EQ(std::isnan(found.inverse_mm.voxels[n].x), !owned && inside) << to_string(voxel);
      if (owned) return;
      ASSERT_EQ(found.output.voxels[n], inside ? -7 : source.voxels[n]) << to_string(voxel);
    });
    EXPECT_EQ(found.report.conflicts, conflicts);
    EXPECT_EQ(found.report.uncovered, uncovered);
    EXPECT_GT(conflicts, 0u);
  }
}

TEST_P(OutsideTheLattice, AFieldThatCarriesEverythingAwayLeavesTheBackground) {
  const Geometry grid = unit_grid({9, 8, 7});
  Random random(2);
  const auto source = random_values<std::int16_t>(grid, random, 0, 100);
  const auto resampler = make(grid);
  for (const glm::vec3& mm : {glm::vec3(30, 0, 0), glm::vec3(0, -9, 0), glm::vec3(1000, 2000, -100000)}) {
    const VertexField field = uniform_field(lattice_over(grid, 2), mm);
    resampler->set_field(view(field));
    const auto found = run(*resampler, source);
    EXPECT_TRUE(same_bits(std::vector<std::int16_t>(source.voxels.size(), -7), found.output.voxels));
    EXPECT_EQ(found.report.uncovered, source.voxels.size());
    EXPECT_TRUE(is_empty(resampler->source_region(grid, whole(grid))));
  }
}

TEST_P(OutsideTheLattice, AStretchedFieldReachesFarBeyondTheOutputAndFillsIt) {
  const Geometry grid = unit_grid({16, 15, 14});
  Random random(3);
  const auto source = random_values<float>(grid, random, 0, 1);
  const glm::dvec3 middle(7, 7, 6);
  const VertexField field =
      field_in_voxels(grid, lattice_over(grid, 1), [&](const glm::dvec3& x) { return 63.0 * (x - middle); });
  const auto resampler = make(grid);
  resampler->set_field(view(field));
  const auto found = run(*resampler, source);
  EXPECT_EQ(found.report.covered, source.voxels.size());
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    const auto expected = reference_sample(source, middle + (glm::dvec3(voxel) - middle) / 64.0, Interpolation::linear);
    ASSERT_NEAR(found.output.voxels[n], expected.value, 1e-5) << to_string(voxel);
  });
}

}  // namespace
}  // namespace tetwarp
