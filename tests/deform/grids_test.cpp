// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Outputs on other grids than the source's: larger, smaller, rotated, anisotropic, mirrored; several sources, each on a
// grid of its own.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/oracle.h"
#include "tests/support/reference_sample.h"
#include "tests/support/run.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Grids);

Geometry grid_about(const glm::dvec3& middle, const glm::i64vec3& size, const glm::dvec3& spacing,
                    const glm::dmat3& direction) {
  Geometry grid{size, spacing, {0, 0, 0}, direction};
  grid.origin = middle - centre(grid);
  return grid;
}

struct NamedGrid {
  const char* name;
  Geometry grid;
};

const glm::dvec3 kMiddle(-31.7, 12.3, 208.1);

Geometry ct_grid() { return grid_about(kMiddle, {16, 15, 12}, {0.9, 1.1, 2}, glm::dmat3(1)); }

/// The grid of another scanner: turned, coarser, with another middle.
Geometry pet_grid() {
  return grid_about(kMiddle + glm::dvec3(1.2, -0.7, 0.4), {9, 11, 13}, {2.2, 1.7, 1.3}, rotation({-1, 0.3, 2}, 1.1));
}

/// What `ct_grid` is resampled onto.
std::vector<NamedGrid> output_grids() {
  const glm::dmat3 turn = rotation({1, 2, -3}, 0.7), mirror(-1, 0, 0, 0, 1, 0, 0, 0, 1);
  return {
      {"larger", grid_about(kMiddle, {24, 23, 20}, {0.9, 1.1, 2}, glm::dmat3(1))},
      {"smaller", grid_about(kMiddle, {7, 8, 5}, {0.9, 1.1, 2}, glm::dmat3(1))},
      {"rotated", grid_about(kMiddle, {16, 15, 12}, {0.9, 1.1, 2}, turn)},
      {"anisotropic", grid_about(kMiddle, {25, 7, 17}, {0.5, 2.3, 1.25}, glm::dmat3(1))},
      {"larger, rotated, anisotropic and mirrored", grid_about(kMiddle, {13, 30, 14}, {1.7, 0.8, 2.5}, turn * mirror)}};
}

/// A map of space with a known inverse: turned, stretched, sheared and shifted about the middle.
struct Affine {
  glm::dmat3 linear = rotation({0.4, -1, 2}, 0.25) * glm::dmat3(1.1, 0, 0, 0.1, 0.9, 0, -0.05, 0.1, 1.05);
  glm::dvec3 shift{1.3, -0.9, 0.7};

  glm::dvec3 forward(const glm::dvec3& x) const { return kMiddle + linear * (x - kMiddle) + shift; }
  glm::dvec3 inverse(const glm::dvec3& p) const { return kMiddle + glm::inverse(linear) * (p - kMiddle - shift); }
};

const glm::dvec3 kSlope(2, -3, 1);  // a mm

double plane(const glm::dvec3& point) { return glm::dot(kSlope, point - kMiddle) + 20; }

/// A volume whose values are a linear function of the place, so that linear interpolation gives the formula between
/// voxels, too.
Volume<float> plane_on(const Geometry& grid) {
  Volume<float> volume{grid, {}};
  const AffineMap point = point_from_index(grid);
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t) {
    volume.voxels.push_back(static_cast<float>(plane(point(glm::dvec3(voxel)))));
  });
  return volume;
}

/// How far inside a grid a place is, or outside (negative), in its voxels.
double depth_in(const Geometry& grid, const glm::dvec3& point) {
  const glm::dvec3 index = index_from_point(grid)(point),
                   room = glm::min(index, glm::dvec3(grid.size - std::int64_t{1}) - index);
  return std::min({room.x, room.y, room.z});
}

/// What a source with the plane shows at a place: up to half a voxel outside it is that of its border.
double plane_in(const Geometry& source, const glm::dvec3& point) {
  const glm::dvec3 index = index_from_point(source)(point);
  return plane(point_from_index(source)(glm::clamp(index, glm::dvec3(0), glm::dvec3(source.size - std::int64_t{1}))));
}

/// The sources CT and PET through the field that a resampler was given, onto its grid.
struct Pair {
  Volume<float> pet;
  Outcome<float> ct;
};

Pair run_pair(Resampler& resampler, const Volume<float>& ct, const Volume<float>& pet, Interpolation of_pet,
              bool pull) {
  const Geometry& grid = resampler.output();
  Pair pair{poisoned<float>(grid), poisoned_outcome<float>(grid)};
  const Target targets[] = {
      {.source = view(ct), .output = view(pair.ct.output), .background = -700},
      {.source = view(pet), .output = view(pair.pet), .interpolation = of_pet, .background = -800}};
  Maps maps = maps_of(pair.ct);
  if (pull) maps.jacobian = maps.owners = maps.tetrahedra = {};
  pair.ct.report = resampler.resample(whole(grid), targets, maps);
  return pair;
}

/// @param reach  where the field is known
void expect_planes(const Pair& found, const Affine& map, const Geometry& reach) {
  const Geometry& grid = found.pet.geometry;
  const AffineMap point = point_from_index(grid);
  // Vertices are rounded to 2^-12 voxel: half that an axis, seen through the inverse.
  const double tolerance = 2 * glm::length(kSlope) * glm::length(grid.spacing) / 8192;
  std::uint64_t inside = 0, covered = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    const glm::dvec3 x = map.inverse(point(glm::dvec3(voxel)));
    const double known = depth_in(reach, x);
    covered += found.ct.coverage.voxels[n];
    if (std::abs(known) < 1e-2) return;
    const auto expect = [&](const Geometry& source, float value, float background) {
      const double depth = depth_in(source, x) + 0.5;
      if (std::abs(depth) < 1e-2) return;
      const bool is_inside = known > 0 && depth > 0;
      ASSERT_NEAR(value, is_inside ? plane_in(source, x) : background, is_inside ? tolerance : 0) << to_string(voxel);
      inside += is_inside;
    };
    expect(ct_grid(), found.ct.output.voxels[n], -700);
    expect(pet_grid(), found.pet.voxels[n], -800);
  });
  EXPECT_GT(inside, 150U);
  EXPECT_EQ(found.ct.report.covered, covered);
  EXPECT_EQ(found.ct.report.covered + found.ct.report.uncovered, found.pet.voxels.size());
}

TEST_P(Grids, APlaneThroughAnAffineFieldIsThatOfTheInverseMap) {
  const Affine map;
  const Volume<float> ct = plane_on(ct_grid()), pet = plane_on(pet_grid());
  for (const NamedGrid& output : output_grids()) {
    const auto resampler = make(output.grid);
    for (const Geometry& over : {ct_grid(), output.grid, pet_grid()}) {
      for (const std::int64_t cell : {1, 3}) {
        SCOPED_TRACE(std::string(output.name) + ", cells of " + std::to_string(cell) + " over " + to_string(over.size));
        VertexField field{lattice_over(over, cell), {}};
        const AffineMap point = point_from_index(field.lattice);
        for_each_voxel(field.lattice, [&](const glm::i64vec3& vertex, std::size_t) {
          const glm::dvec3 x = point(glm::dvec3(vertex));
          field.displacement.emplace_back(map.forward(x) - x);
        });
        resampler->set_field(view(field, Outside::background));
        expect_planes(run_pair(*resampler, ct, pet, Interpolation::linear, false), map, field.lattice);
      }
    }
  }
}

TEST_P(Grids, SoItIsThroughAPullFieldOnAThirdGrid) {
  if (!GetParam().make_pull) GTEST_SKIP() << GetParam().name << " has no pull fields";
  const Affine map;
  const Volume<float> ct = plane_on(ct_grid()), pet = plane_on(pet_grid());
  for (const NamedGrid& output : output_grids()) {
    const auto resampler = GetParam().make_pull(output.grid, {});
    for (const Geometry& samples : {ct_grid(), output.grid, pet_grid()}) {
      SCOPED_TRACE(std::string(output.name) + ", samples on " + to_string(samples.size));
      PullField field{samples, {}};
      const AffineMap point = point_from_index(samples);
      for_each_voxel(samples, [&](const glm::i64vec3& sample, std::size_t) {
        const glm::dvec3 p = point(glm::dvec3(sample));
        field.displacement.emplace_back(map.inverse(p) - p);
      });
      resampler->set_field(view(field, Outside::background));
      const Pair found = run_pair(*resampler, ct, pet, Interpolation::linear, true);
      // Here the field reaches as far as its samples do after the map, not before it.
      Geometry reach = samples;
      reach.origin = map.inverse(samples.origin);
      const glm::dmat3 steps = glm::inverse(map.linear) * point.linear;
      for (int axis = 0; axis < 3; ++axis) reach.direction[axis] = steps[axis] / samples.spacing[axis];
      expect_planes(found, map, reach);
    }
  }
}

/// No plane: what is read at a wrong place shows.
Volume<float> waves_on(const Geometry& grid) {
  Volume<float> volume{grid, {}};
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) {
    const glm::dvec3 x(v);
    volume.voxels.push_back(static_cast<float>(100 * std::sin(0.9 * x.x) + 30 * std::cos(1.3 * x.y) - 20 * x.z));
  });
  return volume;
}

TEST_P(Grids, RandomFieldsGiveEverySourceWhatTheOracleSays) {
  const std::uint64_t seed = test_seed();
  const Volume<float> ct = waves_on(ct_grid()), pet = waves_on(pet_grid());
  std::uint64_t number = 0;
  for (const NamedGrid& output : output_grids()) {
    const auto resampler = make(output.grid);
    const AffineMap point = point_from_index(output.grid), ct_index = index_from_point(ct.geometry) * point,
                    pet_index = index_from_point(pet.geometry) * point;
    const glm::dmat3 voxels_from_mm = index_from_point(output.grid).linear;
    for (const Interpolation of_pet : {Interpolation::nearest, Interpolation::linear, Interpolation::cubic}) {
      Random random(seed, ++number);
      SCOPED_TRACE(seed_text(seed) + ", field " + std::to_string(number) + ", " + output.name);
      const Geometry over = random.chance(0.5) ? ct.geometry : output.grid;
      const VertexField field =
          field_in_voxels(output.grid, lattice_over(over, random.integer(1, 4)), [&](const glm::dvec3&) {
            return 0.8 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
          });
      resampler->set_field(view(field, Outside::background));
      const Pair found = run_pair(*resampler, ct, pet, of_pet, false);
      const Oracle oracle(output.grid, field);
      std::uint64_t inside = 0;
      for_each_voxel(output.grid, [&](const glm::i64vec3& voxel, std::size_t n) {
        const Owners& owners = oracle.owners(voxel);
        ASSERT_EQ(found.ct.owners.voxels[n], owners.count) << to_string(voxel);
        if (owners.count == 0) {
          ASSERT_EQ(found.ct.output.voxels[n], -700) << to_string(voxel);
          ASSERT_EQ(found.pet.voxels[n], -800) << to_string(voxel);
          return;
        }
        const Undeformed exact = oracle.undeformed(voxel);
        const glm::dvec3 u = voxels_from_mm * glm::dvec3(found.ct.inverse_mm.voxels[n]);
        const double off = std::min(glm::distance(u, exact.u), glm::distance(u, exact.alternative));
        ASSERT_LE(off, 2e-7 * (exact.reach * exact.condition + 16)) << to_string(voxel);
        const auto expect = [&](const ReferenceSample& expected, float value, float background) {
          if (expected.jump < 1e-3) return;
          ASSERT_NEAR(value, expected.inside ? expected.value : background, 2e-2) << to_string(voxel);
          inside += expected.inside;
        };
        const glm::dvec3 x = glm::dvec3(voxel) + u;
        expect(reference_sample(ct, ct_index(x), Interpolation::linear), found.ct.output.voxels[n], -700);
        expect(reference_sample(pet, pet_index(x), of_pet), found.pet.voxels[n], -800);
      });
      EXPECT_GT(inside, 100U);
    }
  }
}

}  // namespace
}  // namespace tetwarp
