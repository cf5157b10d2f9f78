// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Coarse fields, by every backend: which fields they are, and where their arithmetic has an edge.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>

#include "deform/field_check.h"
#include "tests/support/against_oracle.h"
#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/meshes.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(CoarseFields);

/// A lattice over a grid of unit spacing, with steps of any length.
Geometry lattice_with_steps(const Geometry& output, const glm::dvec3& steps) {
  Geometry lattice;
  lattice.spacing = steps;
  lattice.size = glm::i64vec3(glm::ceil(glm::dvec3(output.size - std::int64_t{1}) / steps)) + std::int64_t{1};
  return lattice;
}

VertexField shaken(const Geometry& output, const Geometry& lattice, double amplitude, Random& random) {
  return field_in_voxels(output, lattice, [&](const glm::dvec3&) {
    return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
}

/// How many components of an inverse are no whole numbers of 2^-23 voxel. On a grid of unit spacing floats below 2 have
/// that unit, so none of a coarse field is; of a dense one those below 1 mostly are.
int odd_components(const Outcome<float>& found) {
  int odd = 0;
  for (const glm::vec3& u : found.inverse_mm.voxels) {
    for (int axis = 0; axis < 3; ++axis)
      odd += std::abs(u[axis]) < 1 && std::rint(u[axis] * 0x1p23) != u[axis] * 0x1p23;
  }
  return odd;
}

TEST_P(CoarseFields, AreThoseWhoseStepsAreTwoAndAHalfVoxelsOnEachAxis) {
  Random random(7);
  const Geometry output = unit_grid({40, 30, 20});
  const Volume<float> source = smooth_source(output);
  const auto resampler = make(output);
  const struct {
    glm::dvec3 steps;
    bool coarse;
  } cases[] = {{{2.5, 2.5, 2.5}, true}, {{2.49, 4, 4}, false},  {{8, 2, 8}, false},
               {{3, 8, 5}, true},       {{16, 16, 2.4}, false}, {{40, 30, 20}, true}};
  for (const auto& [steps, coarse] : cases) {
    SCOPED_TRACE(std::to_string(steps.x) + ", " + std::to_string(steps.y) + ", " + std::to_string(steps.z));
    const VertexField field = shaken(output, lattice_with_steps(output, steps), 0.5, random);
    EXPECT_EQ(is_coarse(output, view(field, Outside::background)), coarse);
    resampler->set_field(view(field, Outside::background));
    const Outcome<float> found = run(*resampler, source);
    if (coarse) {
      EXPECT_EQ(odd_components(found), 0);
    } else {
      EXPECT_GT(odd_components(found), 1000);
    }
    // A part of the output is what it is in the whole, though the steps are longer than the part.
    const Region part{{3, 5, 7}, {9, 8, 11}};
    auto of_part = poisoned<float>(output), of_all = of_part;
    const auto sample = [&](Volume<float>& to, const Region& region) {
      const Target target{.source = view(source), .output = view(to), .background = -7};
      resampler->resample(region, {&target, 1});
    };
    sample(of_part, part);
    sample(of_all, whole(output));
    for_each_voxel(output, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (contains(part, {voxel, voxel + std::int64_t{1}})) {
        EXPECT_EQ(of_part.voxels[n], of_all.voxels[n]);
      }
    });
  }
}

TEST_P(CoarseFields, ThatMoveFurtherThan255VoxelsHaveTheOraclesPlaces) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(8) && !HasFailure(); ++number) {
    Random random(seed, 8'100'000 + number);
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number));
    const Geometry output = unit_grid({random.integer(560, 700), 9, 8});
    const std::int64_t cell = random.integer(3, 12);
    const double shift = random.real(250, 330);
    const VertexField field = field_in_voxels(output, lattice_over(output, cell), [&](const glm::dvec3& x) {
      return glm::dvec3(-shift, 0, 0) + 0.2 * static_cast<double>(cell) * glm::dvec3(std::sin(x.y), std::sin(x.x), 0.3);
    });
    expect_oracles_result(*make(output), field, Outside::background);
  }
}

TEST_P(CoarseFields, OfTetrahedraOfThousandsOfVoxelsHaveTheOraclesPlaces) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(20) && !HasFailure(); ++number) {
    Random random(seed, 8'200'000 + number);
    SCOPED_TRACE(seed_text(seed) + ", mesh " + std::to_string(number));
    const Geometry output = unit_grid({24, 20, 16});
    const glm::dvec3 beyond(random.real(500, 4000));
    TetrahedralMesh mesh = random_mesh(output, -beyond, glm::dvec3(output.size) + beyond, 2, random);
    shake(mesh, output, 8, 0, random);
    expect_oracles_result(*make(output), field_of(std::move(mesh)), Outside::background);
  }
}

TEST_P(CoarseFields, ThatArePressedFlatOrPulledApartHaveTheOraclesPlaces) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(60) && !HasFailure(); ++number) {
    Random random(seed, 8'300'000 + number);
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number));
    const Geometry output = unit_grid({30, 24, 20});
    const int axis = random.axis();
    const double by = std::exp2(random.real(-14, 3)), middle = static_cast<double>(output.size[axis] / 2);
    const VertexField field =
        field_in_voxels(output, lattice_over(output, random.integer(3, 9)), [&](const glm::dvec3& x) {
          glm::dvec3 moved(random.real(-0.01, 0.01));
          moved[axis] = (x[axis] - middle) * (by - 1);
          return moved;
        });
    expect_oracles_result(*make(output), field, Outside::background);
  }
}

/// Where tetrahedra overlap a tile may be done twice: slices and counts are to be those of the owners, as voxels have
/// them one by one.
TEST_P(CoarseFields, ThatFoldTellTheSlicesAndCountsOfTheirOwners) {
  Random random(test_seed(), 8'400'000);
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry output = unit_grid({36, 18, 7});
  const auto source = random_values<std::int16_t>(output, random, 0, 100);
  const auto resampler = make(output);
  VertexField field = shaken(output, lattice_over(output, 6), 5, random);
  for (glm::vec3& by : field.displacement) by.x += 4;  // so that nobody owns the first columns
  resampler->set_field(view(field, Outside::background));
  for (const Interpolation interpolation : {Interpolation::linear, Interpolation::nearest}) {
    auto to = poisoned<std::int16_t>(output);
    const auto sample = [&](const Region& region, std::span<SliceRange> slices) {
      const Target target{.source = view(source),
                          .output = view(to),
                          .interpolation = interpolation,
                          .background = 1e9,
                          .sampled_slices = slices};
      return resampler->resample(region, {&target, 1});
    };
    std::vector<SliceRange> found(7), expected(7);
    const Report of_all = sample(whole(output), found);
    Report one_by_one;
    for_each_voxel(output, [&](const glm::i64vec3& voxel, std::size_t) {
      one_by_one += sample({voxel, voxel + std::int64_t{1}}, expected);
    });
    EXPECT_GT(of_all.inverted, 5u);
    EXPECT_GT(of_all.uncovered, 100u);
    EXPECT_EQ(of_all.covered, one_by_one.covered);
    EXPECT_EQ(of_all.uncovered, one_by_one.uncovered);
    EXPECT_EQ(of_all.clamped, of_all.uncovered) << "the background does not fit";
    EXPECT_EQ(of_all.clamped, one_by_one.clamped);
    for (std::size_t k = 0; k < 7; ++k) {
      EXPECT_EQ(found[k].first, expected[k].first) << k;
      EXPECT_EQ(found[k].last, expected[k].last) << k;
    }
  }
}

}  // namespace
}  // namespace tetwarp
