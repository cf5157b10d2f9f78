// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The march of the CPU, for every instruction set that the processor has, against claims: bit for bit.
#include "deform/cpu/march.h"

#include <gtest/gtest.h>

#include "tests/support/fields.h"
#include "tests/support/instruction_set.h"
#include "tests/support/shifted.h"

namespace tetwarp::cpu {
namespace {

using namespace test;

class March : public testing::Test {
 protected:
  /// How the marches of a test found owners. Resamplings by claims are not counted: they do not march when they also
  /// count owners.
  Paths paths;

  /// Sends a volume through a field on every instruction set. @return false where the march is not for the field
  void expect_what_claims_give(const FieldCase& test, Random& random) {
    const Volume<std::int16_t> source = random_values<std::int16_t>(test.output, random, -2000, 2000);
    const auto claims = make_cpu_resampler(test.output);
    claims->set_field(view(test.field, Outside::background));
    const Outcome<std::int16_t> expected = run(*claims, source, {.background = 7});
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      const OnInstructionSet on(target);
      const auto resampler = make_cpu_resampler(test.output);
      resampler->set_field(view(test.field, Outside::background));
      Outcome<std::int16_t> found = poisoned_outcome<std::int16_t>(test.output);
      Maps maps = maps_of(found);
      maps.jacobian = maps.owners = maps.tetrahedra = {};
      const Target of{.source = view(source), .output = view(found.output), .background = 7};
      found.report = resampler->resample(whole(test.output), {&of, 1}, maps);
      ASSERT_TRUE(same_bits(expected.output.voxels, found.output.voxels));
      ASSERT_TRUE(same_bits(expected.coverage.voxels, found.coverage.voxels));
      ASSERT_TRUE(same_bits(expected.inverse_mm.voxels, found.inverse_mm.voxels));
      ASSERT_EQ(expected.report.covered, found.report.covered);
      ASSERT_EQ(expected.report.uncovered, found.report.uncovered);
      paths.gathered += found.report.paths.gathered;
      paths.walked += found.report.paths.walked;
      paths.claimed += found.report.paths.claimed;
      ASSERT_EQ(found.report.paths.gathered + found.report.paths.walked + found.report.paths.claimed,
                static_cast<std::uint64_t>(voxel_count(test.output)));
    }
  }
};

/// Sines in general directions: smooth, and without folds where the amplitude is small. In voxels.
glm::dvec3 elastic(const glm::dvec3& rest, double amplitude) {
  return amplitude * glm::dvec3(std::sin(0.11 * rest.x + 0.07 * rest.y - 0.05 * rest.z),
                                std::sin(0.06 * rest.x - 0.12 * rest.y + 0.08 * rest.z),
                                std::sin(0.09 * rest.z + 0.10 * rest.y + 0.04 * rest.x));
}

FieldCase elastic_case(const Geometry& output, std::int64_t cell, double amplitude) {
  return {output,
          field_in_voxels(output, lattice_over(output, cell),
                          [&](const glm::dvec3& rest) { return elastic(rest, amplitude); }),
          "elastic",
          {}};
}

TEST_F(March, SmoothFieldsOverSeveralTiles) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 900);
  for (const std::int64_t cell : {1, 2, 5, 16}) {
    SCOPED_TRACE(cell);
    ASSERT_NO_FATAL_FAILURE(expect_what_claims_give(elastic_case(unit_grid({70, 45, 40}), cell, 3.3), random));
  }
  EXPECT_LT(100 * paths.walked, paths.gathered);
  EXPECT_EQ(paths.claimed, 0u);
}

TEST_F(March, SpacingsThatAreNoPowersOfTwoAndGridsThatAreTurned) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 910);
  Geometry uneven = unit_grid({50, 37, 35});
  uneven.spacing = {0.7, 0.83, 1.25};
  uneven.origin = {-171.3, -160.1, 33.7};
  for (const std::int64_t cell : {1, 3}) {
    ASSERT_NO_FATAL_FAILURE(expect_what_claims_give(elastic_case(uneven, cell, 2.1), random));
    ASSERT_NO_FATAL_FAILURE(expect_what_claims_give(elastic_case(oblique_grid({50, 37, 35}), cell, 2.1), random));
  }
  EXPECT_LT(100 * paths.walked, paths.gathered);
  EXPECT_EQ(paths.claimed, 0u);
}

TEST_F(March, DisplacementsThatLieBetweenTwoSteps) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 920);
  for (const double spacing : {1.0, 0.7}) {
    Geometry output = unit_grid({40, 34, 10});
    output.spacing = glm::dvec3(spacing);
    const auto halves = [&](const glm::dvec3& rest) {
      return (glm::floor(elastic(rest, 2.0) * 4096.0) + 0.5) / 4096.0;
    };
    ASSERT_NO_FATAL_FAILURE(expect_what_claims_give(
        {output, field_in_voxels(output, lattice_over(output, 1), halves), "halves", {}}, random));
  }
  EXPECT_GT(paths.gathered, 0u);
}

/// In such large cells the nudge is as small as the rounding errors of float, and many voxels lie on a slanted face of
/// the centre tetrahedron.
TEST_F(March, LargeCellsWhoseFacesPassThroughVoxels) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 950);
  constexpr double kCell = 997;  // its products need more digits than float has
  const Geometry output = unit_grid({100, 70, 40});
  Geometry lattice = unit_grid({2, 2, 2});
  lattice.spacing = glm::dvec3(kCell);
  const glm::dvec3 on_faces[] = {{332, 333, 332}, {665, 664, 332}, {665, 332, 664}, {332, 665, 664}};
  for (const glm::dvec3& place : on_faces) {
    lattice.origin = glm::dvec3(50, 35, 20) - place;
    const glm::vec3 shift(random.integer(-3, 3), random.integer(-3, 3), 1);
    ASSERT_NO_FATAL_FAILURE(expect_what_claims_give({output, uniform_field(lattice, shift), "", {}}, random));
    VertexField stretched = uniform_field(lattice, shift);
    for (const std::size_t corner : {0, 3, 5, 6})  // not those of the centre
      stretched.displacement[corner].x += static_cast<float>(random.integer(1, 9));
    ASSERT_NO_FATAL_FAILURE(expect_what_claims_give({output, stretched, "", {}}, random));
  }
  EXPECT_GT(paths.gathered, 0u);
}

/// In tetrahedra of more than 256 voxels float does not hold a nudged voxel. Their faces are spanned by few directions,
/// so many voxels lie on them, and the nudges of some axes nearly cancel.
TEST_F(March, TetrahedraThatAreLargerThanFloatsWithANudge) {
  for (const std::uint64_t n : {33, 134}) {
    SCOPED_TRACE(n);
    Random random(7, n);
    const Geometry output = unit_grid({100, 70, 40});
    const int unit = random.one_of<int>({60, 100, 120, 140});
    glm::dmat3 edges(7);
    for (int axis = 0; axis < 3; ++axis) {
      for (int row = 0; row < 3; ++row) edges[axis][row] += static_cast<double>(random.integer(-2, 2));
    }
    const auto corner = [&](int c) {
      return edges * glm::dvec3(c & 1, c >> 1 & 1, c >> 2) * static_cast<double>(unit);
    };
    constexpr int kFaces[4][3] = {{1, 2, 4}, {1, 2, 7}, {2, 4, 7}, {1, 4, 7}};
    const auto& face = kFaces[random.integer(0, 3)];
    double a = random.real(0, 1), b = random.real(0, 1);
    if (a + b > 1) {
      a = 1 - a;
      b = 1 - b;
    }
    const glm::dvec3 on_face =
        corner(face[0]) + a * (corner(face[1]) - corner(face[0])) + b * (corner(face[2]) - corner(face[0]));
    const glm::dvec3 first = glm::dvec3(50, 35, 20) - glm::round(on_face);
    Geometry lattice = unit_grid({2, 2, 2});
    lattice.spacing = glm::dvec3(7 * unit);
    lattice.origin =
        first + glm::dvec3(random.integer(-200, 200), random.integer(-200, 200), random.integer(-200, 200));
    VertexField field{lattice, {}};
    for (int c = 0; c < 8; ++c) {
      const glm::dvec3 rest = lattice.origin + lattice.spacing * glm::dvec3(c & 1, c >> 1 & 1, c >> 2);
      field.displacement.emplace_back(first + corner(c) - rest);
    }
    ASSERT_NO_FATAL_FAILURE(expect_what_claims_give({output, field, "", {}}, random));
  }
  EXPECT_GT(paths.gathered, 0u);
}

TEST_F(March, FieldsAtRestInsideTheVolume) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 960);
  const Geometry output = unit_grid({70, 40, 36});
  Geometry lattice = unit_grid({20, 21, 22});
  lattice.origin = {3.25, 5, 7};
  const VertexField rest = uniform_field(lattice, glm::vec3(0)), moved = uniform_field(lattice, glm::vec3(1.5f));
  ASSERT_NO_FATAL_FAILURE(expect_what_claims_give({output, rest, "", {}}, random));
  EXPECT_EQ(paths.claimed, 0u);

  const Volume<std::int16_t> source = random_values<std::int16_t>(output, random, -2000, 2000);
  const auto resample = [&](ForwardResampler& resampler, const VertexField& field) {  // one field after the other
    resampler.set_field(view(field, Outside::background));
    Volume<std::int16_t> found = poisoned<std::int16_t>(output);
    const Target of{.source = view(source), .output = view(found), .background = 7};
    resampler.resample(whole(output), {&of, 1});
    return found.voxels;
  };
  const auto one = make_cpu_resampler(output), both = make_cpu_resampler(output);
  const std::vector<std::int16_t> expected = resample(*one, rest);
  resample(*both, moved);
  EXPECT_TRUE(same_bits(expected, resample(*both, rest)));
}

/// Each axis bends the lattice by less than what is neglected, but all of them take its last vertex over half a step.
TEST_F(March, LatticesThatLieNearlyHalfwayBetweenSteps) {
  Random random(1);
  Geometry lattice = unit_grid({11, 11, 11});
  lattice.spacing = {2 + 0.9e-7, 2, 2};
  lattice.origin = {100.4895 / 4096, 0, 0};
  const double angle = 0.45e-7;
  lattice.direction = glm::dmat3({1, -angle, -angle}, {angle, 1, 0}, {angle, 0, 1});
  VertexField field = uniform_field(lattice, glm::vec3(0));
  for (std::size_t n = 0; n < 40; ++n) field.displacement[37 * n % field.displacement.size()].y = 0.4f;
  ASSERT_NO_FATAL_FAILURE(expect_what_claims_give({unit_grid({23, 22, 22}), field, "", {}}, random));
}

TEST_F(March, RandomFieldsWithAndWithoutFolds) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t n = 0; n < test_cases(120); ++n) {
    Random random(test_seed(), 1000 + n);
    const FieldCase test = n % 2 == 0 ? random_injective_case(random) : random_folding_case(random);
    SCOPED_TRACE(std::to_string(n) + ": " + test.description);
    ASSERT_NO_FATAL_FAILURE(expect_what_claims_give(test, random));
  }
  EXPECT_GT(paths.gathered, 0u);
  EXPECT_GT(paths.claimed, 0u);
}

TEST_F(March, FieldsThatLeaveTheVolumeAndFieldsThatAreTooFarAway) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 930);
  const Geometry output = unit_grid({36, 34, 9});
  for (const double far : {20.0, 900.0, 1200.0, 5000.0}) {
    SCOPED_TRACE(far);
    const auto moved = [&](const glm::dvec3& rest) {  // a corner that goes far, and drags its cells with it
      return elastic(rest, 1.0) + (rest.x + rest.y + rest.z < 4 ? glm::dvec3(far, -far, far / 2) : glm::dvec3(0));
    };
    ASSERT_NO_FATAL_FAILURE(
        expect_what_claims_give({output, field_in_voxels(output, lattice_over(output, 1), moved), "far", {}}, random));
  }
}

/// A part of the output is made as the whole is.
TEST_F(March, RegionsBeginAnywhere) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 940);
  const FieldCase test = elastic_case(unit_grid({70, 45, 40}), 1, 3.3);
  const Volume<std::int16_t> source = random_values<std::int16_t>(test.output, random, -2000, 2000);
  const auto resampler = make_cpu_resampler(test.output);
  resampler->set_field(view(test.field, Outside::background));
  const auto resample = [&](const Region& region) {
    Outcome<std::int16_t> found = poisoned_outcome<std::int16_t>(test.output);
    const Target of{.source = view(source), .output = view(found.output), .background = 7};
    resampler->resample(region, {&of, 1});
    return found.output;
  };
  const Volume<std::int16_t> all = resample(whole(test.output));
  for (int n = 0; n < 20; ++n) {
    Region part;
    for (int axis = 0; axis < 3; ++axis) {
      part.begin[axis] = random.integer(0, test.output.size[axis] - 1);
      part.end[axis] = random.integer(part.begin[axis] + 1, test.output.size[axis]);
    }
    const Volume<std::int16_t> found = resample(part), untouched = poisoned<std::int16_t>(test.output);
    for_each_voxel(test.output, [&](const glm::i64vec3& voxel, std::size_t at) {
      const bool inside = contains(part, Region{voxel, voxel + std::int64_t{1}});
      ASSERT_EQ(found.voxels[at], (inside ? all : untouched).voxels[at]);
    });
  }
}

}  // namespace
}  // namespace tetwarp::cpu
