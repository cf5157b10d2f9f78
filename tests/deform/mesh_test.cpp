// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <glm/common.hpp>
#include <limits>

#include "deform/field_quality.h"
#include "deform/fields/lattice_mesh.h"
#include "deform/fields/point_map.h"
#include "deform/points.h"
#include "deform/residuals.h"
#include "tests/support/against_oracle.h"
#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/meshes.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Meshes);

Geometry any_grid(Random& random, const glm::i64vec3& size) {
  return random.chance(0.5) ? unit_grid(size) : oblique_grid(size);
}

glm::dvec3 last_of(const Geometry& grid) { return glm::dvec3(grid.size - std::int64_t{1}); }

/// Without maps, one volume and two: a backend may have other ways then.
void expect_same_volumes(ForwardResampler& resampler, const Volume<std::int16_t>& source, const VertexField& lattice,
                         const VertexField& mesh, Random& random) {
  const Geometry& grid = source.geometry;
  const auto labels = random_values<std::uint8_t>(grid, random, 0, 5);
  for (const std::size_t targets : {1, 2}) {
    auto expected = poisoned<std::int16_t>(grid), found = expected;
    auto expected_labels = poisoned<std::uint8_t>(grid), found_labels = expected_labels;
    const auto send = [&](const VertexField& field, Volume<std::int16_t>& volume, Volume<std::uint8_t>& of_labels) {
      const Target both[] = {
          {.source = view(source), .output = view(volume), .background = -7},
          {.source = view(labels), .output = view(of_labels), .interpolation = Interpolation::vote, .background = 9}};
      resampler.set_field(view(field, Outside::background));
      return resampler.resample(whole(grid), std::span(both).first(targets));
    };
    const Report of_lattice = send(lattice, expected, expected_labels), of_mesh = send(mesh, found, found_labels);
    EXPECT_TRUE(same_bits(expected.voxels, found.voxels)) << targets << " volumes";
    EXPECT_TRUE(same_bits(expected_labels.voxels, found_labels.voxels)) << "labels";  // poisoned both, or written
    EXPECT_EQ(of_lattice.covered, of_mesh.covered);
    EXPECT_EQ(of_lattice.uncovered, of_mesh.uncovered);
  }
}

TEST_P(Meshes, TheTetrahedraOfALatticeGiveWhatTheLatticeGives) {
  const std::uint64_t seed = test_seed();
  std::uint64_t folded = 0;
  for (std::uint64_t number = 0; number < test_cases(60) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number));
    Random random(seed, 5'000'000 + number);
    const Geometry grid = unit_grid({random.integer(30, 75), random.integer(5, 40), random.integer(5, 37)});
    const std::int64_t cell = random.integer(1, 12);
    const double amplitude = random.real(0, 0.6) * static_cast<double>(cell);
    const VertexField lattice = field_in_voxels(grid, lattice_over(grid, cell), [&](const glm::dvec3&) {
      return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    VertexField mesh = field_of(mesh_of(lattice));
    mesh.lattice = lattice.lattice;  // which says whether the field is coarse
    const auto source = random_values<std::int16_t>(grid, random, -1000, 2000);
    const auto resampler = make(grid);
    resampler->set_field(view(lattice, Outside::background));
    const auto expected = run(*resampler, source, {.interpolation = Interpolation::cubic});
    resampler->set_field(view(mesh, Outside::background));
    const auto found = run(*resampler, source, {.interpolation = Interpolation::cubic});
    EXPECT_TRUE(same_bits(expected.output.voxels, found.output.voxels)) << "output";
    EXPECT_TRUE(same_bits(expected.coverage.voxels, found.coverage.voxels)) << "coverage";
    EXPECT_TRUE(same_bits(expected.inverse_mm.voxels, found.inverse_mm.voxels)) << "inverse";
    EXPECT_TRUE(same_bits(expected.owners.voxels, found.owners.voxels)) << "owners";
    EXPECT_TRUE(same_bits(expected.jacobian.voxels, found.jacobian.voxels)) << "jacobian";
    EXPECT_EQ(expected.report.inverted, found.report.inverted);
    EXPECT_EQ(expected.report.multiply_owned, found.report.multiply_owned);
    folded += found.report.multiply_owned.value_or(0);
    expect_same_volumes(*resampler, source, lattice, mesh, random);
  }
  EXPECT_GT(folded, 1000u);
}

TEST_P(Meshes, OwnersAreTheOracles) {
  const std::uint64_t seed = test_seed();
  std::uint64_t folded = 0;
  for (std::uint64_t number = 0; number < test_cases(150) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", mesh " + std::to_string(number));
    Random random(seed, 6'000'000 + number);
    const Geometry grid = any_grid(random, {random.integer(2, 45), random.integer(2, 14), random.integer(2, 20)});
    const glm::dvec3 beyond = random.chance(0.5) ? glm::dvec3(0) : glm::dvec3(random.real(-3, 200));
    TetrahedralMesh mesh =
        random_mesh(grid, -beyond, last_of(grid) + beyond, static_cast<int>(random.integer(1, 5)), random);
    shake(mesh, grid, random.real(0, 4), random.real(0, 2), random);
    const VertexField field = field_of(std::move(mesh));
    const Oracle oracle = expect_oracles_result(*make(grid), field, Outside::background);
    folded += oracle.multiply_owned;
  }
  EXPECT_GT(folded, 1000u);
}

/// Tetrahedra of up to 3000 voxels a side, whose determinants need more than 64 bits.
TEST_P(Meshes, LargeTetrahedraHaveTheOraclesOwners) {
  const std::uint64_t seed = test_seed();
  std::uint64_t owned = 0;
  for (std::uint64_t number = 0; number < test_cases(80) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", mesh " + std::to_string(number));
    Random random(seed, 7'000'000 + number);
    const Geometry grid = any_grid(random, {random.integer(30, 70), random.integer(5, 12), random.integer(5, 12)});
    const double beyond = random.real(60, 3000);
    TetrahedralMesh mesh = random_mesh(grid, glm::dvec3(-beyond), last_of(grid) + beyond, 2, random);
    shake(mesh, grid, random.real(0, 30), random.real(0, 30), random);
    const VertexField field = field_of(std::move(mesh));
    const Oracle oracle = expect_oracles_result(*make(grid), field, Outside::background);
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t) { owned += oracle.owners(voxel).count > 0; });
  }
  EXPECT_GT(owned, 10000u);
}

TEST_P(Meshes, OverlapsGoToTheLowestNumberAndFlatTetrahedraOwnNothing) {
  const std::uint64_t seed = test_seed();
  std::uint64_t several = 0, degenerate = 0;
  for (std::uint64_t number = 0; number < test_cases(100) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", mesh " + std::to_string(number));
    Random random(seed, 8'000'000 + number);
    const Geometry grid = any_grid(random, {40, 17, 19});
    const VertexField field =
        field_of(loose_tetrahedra(grid, static_cast<int>(random.integer(1, 60)), random.real(2, 40), random));
    const Oracle oracle = expect_oracles_result(*make(grid), field, Outside::background);
    several += oracle.multiply_owned;
    degenerate += oracle.degenerate;
  }
  EXPECT_GT(several, 10000u);
  EXPECT_GT(degenerate, 50u);
}

TEST_P(Meshes, AMeshAtRestCopiesAndAWholeShiftShifts) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(40) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", mesh " + std::to_string(number));
    Random random(seed, 9'000'000 + number);
    const bool is_exact = random.chance(0.5);
    const Geometry grid = is_exact ? unit_grid({35, 12, 11}) : oblique_grid({35, 12, 11});
    VertexField field = field_of(random_mesh(grid, glm::dvec3(0), last_of(grid), 6, random));
    const auto source = random_values<std::int16_t>(grid, random, -1000, 2000);
    const auto resampler = make(grid);
    resampler->set_field(view(field));  // and reaches over the whole grid, by the rule of refuse
    const auto copied = run(*resampler, source);
    EXPECT_TRUE(same_bits(source.voxels, copied.output.voxels));
    EXPECT_EQ(copied.report.covered, source.voxels.size());
    EXPECT_EQ(copied.report.multiply_owned, 0u);
    if (!is_exact) continue;  // a shift in float mm is a whole one on a unit grid alone
    const glm::i64vec3 shift(2, -1, 3);
    for (glm::vec3& by : field.mesh.displacement) by = glm::vec3(point_from_index(grid).linear * glm::dvec3(shift));
    resampler->set_field(view(field));
    const auto found = run(*resampler, source);
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      const bool any = is_voxel(grid, voxel - shift);
      ASSERT_EQ(found.output.voxels[n], any ? source.voxels[offset_of(grid, voxel - shift)] : -7) << to_string(voxel);
    });
  }
}

TEST_P(Meshes, RegionsAndThreadsChangeNothing) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed, 10'000'000);
  const Geometry grid = unit_grid({97, 70, 66});
  TetrahedralMesh mesh = random_mesh(grid, glm::dvec3(-5), last_of(grid) + 5.0, 8, random);
  shake(mesh, grid, 6, 3, random);
  const VertexField field = field_of(std::move(mesh));
  const auto source = random_values<std::int16_t>(grid, random, -1000, 2000);
  const auto resampler = make(grid, 1);
  resampler->set_field(view(field, Outside::rest));
  const auto expected = run(*resampler, source);
  const auto many = make(grid);
  many->set_field(view(field, Outside::rest));
  for (int number = 0; number < 3; ++number) {
    auto found = poisoned_outcome<std::int16_t>(grid);
    glm::i64vec3 cut(random.integer(1, 96), random.integer(1, 69), random.integer(1, 65));
    for (int part = 0; part < 8; ++part) {
      Region region{glm::i64vec3(0), grid.size};
      for (int axis = 0; axis < 3; ++axis) ((part >> axis & 1) != 0 ? region.begin : region.end)[axis] = cut[axis];
      const Region needed = many->source_region(grid, region);
      const Target target{
          .source = {&grid, needed, VoxelType::i16, 1, nullptr}, .output = view(found.output), .background = -7};
      std::vector<std::int16_t> part_of_source;  // what source_region promises is enough
      for (std::int64_t k = needed.begin.z; k < needed.end.z; ++k) {
        for (std::int64_t j = needed.begin.y; j < needed.end.y; ++j) {
          for (std::int64_t i = needed.begin.x; i < needed.end.x; ++i)
            part_of_source.push_back(source.voxels[offset_of(grid, {i, j, k})]);
        }
      }
      Target held = target;
      held.source.voxels = std::as_bytes(std::span(part_of_source)).data();
      found.report += many->resample(region, {&held, 1}, maps_of(found));
    }
    expect_same_outcome(expected, found);
    expect_same_report(expected.report, found.report);
  }
}

/// A mesh of an organ: what lies outside it, undeformed, keeps the source's value.
TEST_P(Meshes, RestKeepsTheSourceRoundAMeshWhoseBorderRests) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(30) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", mesh " + std::to_string(number));
    Random random(seed, 11'000'000 + number);
    const Geometry grid = any_grid(random, {36, 15, 13});
    const glm::dvec3 low(random.real(1, 8), random.real(1, 4), random.real(1, 4)),
        high(random.real(20, 33), random.real(9, 13), random.real(8, 11));
    TetrahedralMesh mesh = random_mesh(grid, low, high, 5, random);
    const bool moves_border = random.chance(0.5);
    shake(mesh, grid, moves_border ? 1 : 0.01, moves_border ? 1 : 0, random);
    const VertexField field = field_of(std::move(mesh));
    const auto source = random_values<float>(grid, random, -1000, 1000);
    const auto resampler = make(grid);
    EXPECT_THROW(resampler->set_field(view(field)), InputError);
    resampler->set_field(view(field, Outside::rest));
    const auto found = run(*resampler, source);
    VertexField still = field;
    std::fill(still.mesh.displacement.begin(), still.mesh.displacement.end(), glm::vec3(0));
    const Oracle moved(grid, field), at_rest(grid, still);
    std::uint64_t conflicts = 0;
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      const bool owned = moved.owners(voxel).count > 0, inside = at_rest.owners(voxel).count > 0;
      conflicts += owned && !inside;
      ASSERT_EQ(found.coverage.voxels[n], owned || !inside) << to_string(voxel);
      if (owned || inside) return;
      ASSERT_EQ(found.output.voxels[n], source.voxels[n]) << to_string(voxel);
      ASSERT_EQ(found.inverse_mm.voxels[n], glm::vec3(0));
      ASSERT_EQ(found.jacobian.voxels[n], 1.0f);
    });
    EXPECT_EQ(found.report.conflicts, conflicts);
    EXPECT_TRUE(moves_border || conflicts == 0);
  }
}

/// Undeformed without volume, deformed with: its voxels come from where it lay flat.
TEST_P(Meshes, WhatWasFlatOwnsButHasNoJacobian) {
  const Geometry grid = unit_grid({9, 9, 9});
  TetrahedralMesh mesh;
  mesh.rest = {{1, 1, 4}, {7, 1, 4}, {1, 7, 4}, {3, 3, 4}};
  mesh.displacement = {glm::vec3(0), glm::vec3(0), glm::vec3(0), {0, 0, 4}};
  mesh.tetrahedra = {{0, 1, 2, 3}};
  const auto resampler = make(grid);
  const VertexField field = field_of(mesh);
  resampler->set_field(view(field, Outside::background));
  Volume<std::int16_t> source{grid, {}};
  for_each_voxel(
      grid, [&](const glm::i64vec3& v, std::size_t) { source.voxels.push_back(static_cast<std::int16_t>(100 * v.z)); });
  const auto found = run(*resampler, source);
  EXPECT_EQ(found.report.degenerate, 1u);
  EXPECT_EQ(found.report.inverted, 0u);
  EXPECT_GT(found.report.covered, 5u);
  for (std::size_t n = 0; n < source.voxels.size(); ++n)
    ASSERT_EQ(found.output.voxels[n], found.coverage.voxels[n] ? 400 : -7);
}

void expect_refused(ForwardResampler& resampler, const TetrahedralMesh& mesh, const std::string& part) {
  VertexField field;
  field.mesh = mesh;
  const FieldView given{.outside = Outside::background, .mesh = &field.mesh};
  try {
    resampler.set_field(given);
    FAIL() << "accepted; expected a refusal with \"" << part << "\"";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST_P(Meshes, BadMeshesAreRefused) {
  Random random(1);
  const Geometry grid = unit_grid({9, 8, 7});
  const TetrahedralMesh good = random_mesh(grid, glm::dvec3(0), last_of(grid), 2, random);
  const auto resampler = make(grid);
  TetrahedralMesh bad = good;
  bad.tetrahedra.clear();
  expect_refused(*resampler, bad, "no tetrahedra");
  bad = good;
  bad.displacement.pop_back();
  expect_refused(*resampler, bad, "one for each vertex");
  bad = good;
  bad.tetrahedra.back().z = static_cast<std::uint32_t>(good.rest.size());
  expect_refused(*resampler, bad, "tetrahedron " + std::to_string(good.tetrahedra.size() - 1));
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e7}) {
    bad = good;
    bad.rest[3].y = value;
    expect_refused(*resampler, bad, "vertex 3");
    bad = good;
    bad.displacement[5].z = static_cast<float>(value);
    expect_refused(*resampler, bad, "vertex 5");
  }
  EXPECT_THROW(resampler->resample(whole(grid), {}), InputError);  // no field is held
  const VertexField field = field_of(good);
  resampler->set_field(view(field));
}

TEST_P(Meshes, RefuseNamesTheFirstVoxelOutside) {
  const Geometry grid = unit_grid({40, 8, 7});
  Random random(1);
  const VertexField field = field_of(random_mesh(grid, {0, 0, 0}, {39, 7, 4.5}, 3, random));
  const auto resampler = make(grid);
  try {
    resampler->set_field(view(field));
    FAIL() << "accepted";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("640 of 2240 voxels"), std::string::npos) << text;
    EXPECT_NE(text.find("(0, 0, 5)"), std::string::npos) << text;
  }
}

/// Moves the centre of each voxel to where it comes from and forward again.
TEST_P(Meshes, PointsGoWhereTheVolumeGoes) {
  const std::uint64_t seed = test_seed();
  std::uint64_t moved = 0;
  for (std::uint64_t number = 0; number < test_cases(30) && !HasFailure(); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", mesh " + std::to_string(number));
    Random random(seed, 12'000'000 + number);
    const Geometry grid = any_grid(random, {33, 14, 12});
    TetrahedralMesh mesh = random_mesh(grid, glm::dvec3(-2), last_of(grid) + 2.0, 4, random);
    shake(mesh, grid, random.real(0, 0.5), 0, random);
    const VertexField field = field_of(std::move(mesh));
    const auto resampler = make(grid);
    resampler->set_field(view(field, Outside::background));
    const auto found = run(*resampler, smooth_source(grid));
    const PointMover mover(grid, view(field, Outside::background));
    const AffineMap point = point_from_index(grid), index = index_from_point(grid);
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (found.owners.voxels[n] != 1 || found.jacobian.voxels[n] < 0.01f) return;
      glm::dvec3 at = point(glm::dvec3(voxel)) + glm::dvec3(found.inverse_mm.voxels[n]);
      ASSERT_EQ(mover.move(at), PointStatus::moved) << to_string(voxel);
      ASSERT_LT(distance(index(at), glm::dvec3(voxel)), 0.02) << to_string(voxel);
      ++moved;
    });
    glm::dvec3 far = point(glm::dvec3(-9, 3, 3));
    const glm::dvec3 before = far;
    EXPECT_EQ(mover.move(far), PointStatus::outside);
    EXPECT_EQ(far, before);
  }
  EXPECT_GT(moved, 50000u);
}

/// What a lattice's points, quality and composition are, its tetrahedra have too.
TEST_P(Meshes, EverythingElseSeesTheTetrahedraOfALatticeAsTheLattice) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed, 13'000'000);
  const Geometry grid = unit_grid({20, 19, 18});
  VertexField lattice = field_in_voxels(grid, lattice_over(grid, 3), [&](const glm::dvec3&) {
    return glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
  VertexField mesh = field_of(mesh_of(lattice));
  const PointMap next = [](const glm::dvec3& at) { return glm::dvec3(0.1 * at.y, 0, -0.2 * at.x); };
  compose(lattice, next);
  compose(mesh, next);
  EXPECT_TRUE(same_bits(lattice.displacement, mesh.mesh.displacement));
  for (int n = 0; n < 1000; ++n) {
    glm::dvec3 a(random.real(-0.5, 21), random.real(-0.5, 19), random.real(-0.5, 18)), b = a;
    const PointStatus of_lattice = PointMover(grid, view(lattice)).move(a);
    EXPECT_EQ(PointMover(grid, view(mesh, Outside::background)).move(b), of_lattice);
    EXPECT_LT(distance(a, b), 1e-6);
  }
  const auto resampler = make(grid);
  const auto trip = [&](const VertexField& field) {
    resampler->set_field(view(field, Outside::background));
    return measure_round_trip(*resampler, field);
  };
  const RoundTrip by_lattice = trip(lattice), by_mesh = trip(mesh);
  EXPECT_EQ(by_lattice.forward_after_inverse.points, by_mesh.forward_after_inverse.points);
  EXPECT_EQ(by_lattice.inverse_after_forward.points, by_mesh.inverse_after_forward.points);
  EXPECT_GT(by_mesh.inverse_after_forward.points, 60u);
  EXPECT_NEAR(by_lattice.forward_after_inverse.mean, by_mesh.forward_after_inverse.mean, 1e-9);
  EXPECT_NEAR(by_lattice.inverse_after_forward.largest, by_mesh.inverse_after_forward.largest, 1e-9);
  const FieldQuality of_lattice = measure_quality(lattice), of_mesh = measure_quality(mesh);
  EXPECT_NEAR(of_lattice.largest_stretch, of_mesh.largest_stretch, 1e-9);
  for (std::size_t bin = 0; bin < of_lattice.parts.size(); ++bin)
    EXPECT_NEAR(of_lattice.shares()[bin], of_mesh.shares()[bin], 1e-9);
}

}  // namespace
}  // namespace tetwarp
