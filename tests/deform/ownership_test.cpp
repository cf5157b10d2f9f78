// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/matrix.hpp>

#include "tests/support/against_oracle.h"
#include "tests/support/backends.h"
#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Ownership);

/// Without the oracle: one owner inside the image of the lattice's box, none outside, at most one on its border.
void expect_one_owner_inside(const Outcome<float>& found, const FieldCase& test) {
  const AffineMap index = index_from_point(test.output) * point_from_index(test.field.lattice);
  const glm::dvec3 last = glm::round(index(glm::dvec3(test.field.lattice.size - std::int64_t{1})));
  const glm::dmat3 inverse = glm::inverse(test.image.linear);
  const bool kept = test.image.linear == glm::dmat3(1) && test.image.offset == glm::dvec3(0);
  for_each_voxel(test.output, [&](const glm::i64vec3& voxel, std::size_t n) {
    const glm::dvec3 x = inverse * (glm::dvec3(voxel) - test.image.offset);
    const double depth = std::min({x.x, x.y, x.z, last.x - x.x, last.y - x.y, last.z - x.z});
    if (depth > 1e-9 || (kept && depth > -1e-9)) {
      ASSERT_EQ(found.owners.voxels[n], 1) << to_string(voxel);
    } else if (depth < -1e-9) {
      ASSERT_EQ(found.owners.voxels[n], 0) << to_string(voxel);
    } else {
      ASSERT_LE(found.owners.voxels[n], 1) << to_string(voxel);
    }
  });
}

TEST_P(Ownership, EveryVoxelOfAnInjectiveFieldHasOneOwnerInsideAndNoneOutside) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < 2000 && !HasFailure(); ++number) {
    Random random(seed, number);
    const FieldCase test = random_injective_case(random);
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number) + ": " + test.description);
    const Volume<float> source = smooth_source(test.output);
    const auto resampler = make(test.output);
    resampler->set_field(view(test.field));
    const Outcome<float> found = run(*resampler, source);
    expect_one_owner_inside(found, test);
    expect_like_oracle(found, source, Oracle(test.output, test.field));
    EXPECT_EQ(found.report.multiply_owned, 0u);
    EXPECT_EQ(found.report.degenerate, 0u);
  }
}

TEST_P(Ownership, FoldsGoToTheLowestNumberAndFlatTetrahedraOwnNothing) {
  const std::uint64_t seed = test_seed();
  std::uint64_t folds = 0, degenerate = 0;
  for (std::uint64_t number = 0; number < 1000 && !HasFailure(); ++number) {
    Random random(seed, 1'000'000 + number);
    const FieldCase test = random_folding_case(random);
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number) + ": " + test.description);
    const Oracle oracle = expect_oracles_result(*make(test.output), test.field);
    folds += oracle.multiply_owned;
    degenerate += oracle.degenerate;
  }
  EXPECT_GT(folds, 1000u);
  EXPECT_GT(degenerate, 1000u);
}

TEST_P(Ownership, TinyTetrahedraAreInterpolatedWhereTheirWeightsAreWithinTheSlack) {
  // Everything is pressed into some 2^-12 voxels round one voxel, so that the nudge is as long as a tetrahedron.
  const std::uint64_t seed = test_seed();
  const Geometry output = unit_grid({3, 3, 3});
  const auto resampler = make(output);
  std::uint64_t owned = 0;
  for (std::uint64_t number = 0; number < 3000 && !HasFailure(); ++number) {
    Random random(seed, 4'000'000 + number);
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number));
    const double size = random.real(2, 300), jitter = random.real(0, 0.4);
    const VertexField field = field_in_voxels(output, lattice_over(output, 1), [&](const glm::dvec3& x) {
      const glm::dvec3 shaken(random.real(-jitter, jitter), random.real(-jitter, jitter), random.real(-jitter, jitter));
      return glm::dvec3(1) + size / 4096 * (x - 1.0 + shaken) - x;
    });
    const Oracle oracle = expect_oracles_result(*resampler, field);
    owned += oracle.owners({1, 1, 1}).count;
  }
  EXPECT_GT(owned, 1500u);
}

TEST_P(Ownership, LatticesOffTheGridHaveTheOraclesOwners) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < 200 && !HasFailure(); ++number) {
    Random random(seed, 2'000'000 + number);
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number));
    const Geometry output = random.chance(0.5) ? oblique_grid({9, 8, 7}) : unit_grid({9, 8, 7});
    Geometry lattice;
    lattice.size = {random.integer(2, 6), random.integer(2, 6), random.integer(2, 6)};
    lattice.spacing = {random.real(0.4, 4), random.real(0.4, 4), random.real(0.4, 4)};
    lattice.direction = rotation({random.real(-1, 1), random.real(-1, 1), 1}, random.real(-3, 3));
    if (random.chance(0.3)) lattice.direction[0] *= -1.0;
    lattice.origin = centre(output) -
                     lattice.direction * (lattice.spacing * 0.5 * glm::dvec3(lattice.size - std::int64_t{1})) +
                     glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    const double amplitude = random.real(0, 1);
    const VertexField field = field_in_voxels(output, lattice, [&](const glm::dvec3&) {
      return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    expect_oracles_result(*make(output), field, Outside::background);
  }
}

TEST_P(Ownership, OneResamplerTakesFieldAfterField) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  const Geometry output = unit_grid({9, 8, 10});
  const auto resampler = make(output);
  Random random(seed, 3'000'000);
  for (const std::int64_t cell : {1, 4, 2, 9, 3}) {
    const VertexField field = field_in_voxels(output, lattice_over(output, cell), [&](const glm::dvec3&) {
      return glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    expect_oracles_result(*resampler, field);
  }
}

}  // namespace
}  // namespace tetwarp
