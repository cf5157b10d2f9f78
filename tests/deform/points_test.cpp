// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Points moved by the forward map, against the resampler, against the definition, and against images.
#include "deform/points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "deform/fields/formula.h"
#include "tests/support/backends.h"
#include "tests/support/fields.h"
#include "tests/support/run.h"

namespace tetwarp {
namespace {

using namespace test;

glm::dvec3 moved(const Geometry& output, const VertexField& field, const glm::dvec3& point,
                 Outside outside = Outside::background) {
  glm::dvec3 result = point;
  const auto status = move_points(output, view(field, outside), {&result, 1});
  EXPECT_EQ(status.size(), 1u);
  EXPECT_EQ(status[0], PointStatus::moved) << point.x << " " << point.y << " " << point.z;
  return result;
}

double length_in_voxels(const Geometry& grid, const glm::dvec3& mm) {
  return glm::length(index_from_point(grid).linear * mm);
}

/// The definition, in other mathematics: all tetrahedra of the lattice, snapped, and the 4x4 system (Eq. 6).
class Definition {
 public:
  Definition(const Geometry& output, const VertexField& field) : output_(output), size_(field.lattice.size) {
    const AffineMap index = index_from_point(output), point = point_from_index(field.lattice);
    for_each_voxel(field.lattice, [&](const glm::i64vec3& vertex, std::size_t n) {
      const glm::dvec3 rest = index(point(glm::dvec3(vertex)));
      rest_.push_back(snapped(rest));
      deformed_.push_back(snapped(rest + index.linear * glm::dvec3(field.displacement[n])));
    });
  }

  const glm::dvec3& deformed(std::size_t vertex) const { return deformed_[vertex]; }
  const glm::dvec3& rest(std::size_t vertex) const { return rest_[vertex]; }

  glm::dvec3 operator()(const glm::dvec3& point) const {
    // Even cells, then odd ones: corner c is x + 2y + 4z.
    constexpr int kTetrahedra[2][5][4] = {{{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}},
                                          {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 3, 0, 6}, {4, 5, 6, 0}, {7, 6, 5, 3}}};
    const glm::dvec4 x(index_from_point(output_)(point), 1);
    double best = -INFINITY;
    glm::dvec3 result(0);
    Geometry cells;
    cells.size = size_ - std::int64_t{1};
    for_each_voxel(cells, [&](const glm::i64vec3& cell, std::size_t) {
      for (const auto& corners : kTetrahedra[(cell.x + cell.y + cell.z) & 1]) {
        glm::dmat4 before;
        glm::dvec3 after[4];
        for (int n = 0; n < 4; ++n) {
          const int c = corners[n];
          const glm::i64vec3 at = cell + glm::i64vec3(c & 1, c >> 1 & 1, c >> 2);
          const auto vertex = static_cast<std::size_t>(at.x + size_.x * (at.y + size_.y * at.z));
          before[n] = glm::dvec4(rest_[vertex], 1);
          after[n] = deformed_[vertex];
        }
        const glm::dvec4 w = glm::inverse(before) * x;
        const double least = std::min({w.x, w.y, w.z, w.w});
        if (least <= best) continue;
        best = least;
        result = w.x * after[0] + w.y * after[1] + w.z * after[2] + w.w * after[3];
      }
    });
    return point_from_index(output_)(result);
  }

 private:
  static glm::dvec3 snapped(const glm::dvec3& index) {
    return {std::nearbyint(index.x * 4096) / 4096, std::nearbyint(index.y * 4096) / 4096,
            std::nearbyint(index.z * 4096) / 4096};
  }

  Geometry output_;
  glm::i64vec3 size_;
  std::vector<glm::dvec3> rest_, deformed_;
};

/// A lattice that lies askew to the output: no vertex is at a whole step.
FieldCase askew_case(Random& random) {
  const Geometry output = oblique_grid({17, 15, 13});
  Geometry lattice = output;
  lattice.size = {5, 4, 6};
  lattice.spacing = {3.1, 4.3, 3.7};
  lattice.direction = rotation({1, -2, 0.5}, 0.9);
  lattice.origin = output.origin + glm::dvec3(-2.3, 1.7, 0.9);
  return {output,
          field_in_voxels(output, lattice,
                          [&](const glm::dvec3&) {
                            return glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
                          }),
          "askew",
          {}};
}

TEST(Points, AVertexGoesExactlyToItsSnappedPlace) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t number = 0; number < test_cases(60); ++number) {
    Random random(test_seed(), number);
    const FieldCase test = random.chance(0.5) ? random_injective_case(random) : random_folding_case(random);
    SCOPED_TRACE(test.description);
    const Definition definition(test.output, test.field);
    const AffineMap point = point_from_index(test.field.lattice), index = index_from_point(test.output);
    for_each_voxel(test.field.lattice, [&](const glm::i64vec3& vertex, std::size_t n) {
      const glm::dvec3 rest = point(glm::dvec3(vertex));
      // Only where the undeformed vertex itself lies at a whole step is its place that of the snapped one.
      if (glm::length(index(rest) - definition.rest(n)) > 1e-12) return;
      const glm::dvec3 found = index(moved(test.output, test.field, rest));
      ASSERT_LE(glm::length(found - definition.deformed(n)), 1e-10) << "vertex " << to_string(vertex);
    });
  }
}

TEST(Points, EveryPlaceIsThatOfTheDefinition) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t number = 0; number < test_cases(12); ++number) {
    Random random(test_seed(), number);
    const FieldCase test = askew_case(random);
    const Definition definition(test.output, test.field);
    const AffineMap point = point_from_index(test.field.lattice);
    const glm::dvec3 last(test.field.lattice.size - std::int64_t{1});
    for (int n = 0; n < 60; ++n) {
      // Half of them within 2^-13 voxel of a face of a cell: snapping puts these on either side of it.
      glm::dvec3 at(random.real(0, last.x), random.real(0, last.y), random.real(0, last.z));
      const int axis = random.axis();
      if (n % 2 == 0) at[axis] = std::round(at[axis]) + random.real(-2e-5, 2e-5);
      at = glm::clamp(at, glm::dvec3(0), last);
      const glm::dvec3 found = moved(test.output, test.field, point(at));
      ASSERT_LE(length_in_voxels(test.output, found - definition(point(at))), 1e-8) << n;
    }
  }
}

TEST(Points, AffineFieldsAreExact) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed());
  const glm::dmat3 gradient(0.25, 0.125, -0.5, 0.0625, -0.125, 0.25, 0, 0.5, 0.125);
  for (const std::int64_t cell_size : {1, 3, 7, 16}) {
    const Geometry grid = unit_grid({20, 17, 15});
    const VertexField field = field_in_voxels(grid, lattice_over(grid, cell_size),
                                              [&](const glm::dvec3& x) { return gradient * x + glm::dvec3(1, 2, 3); });
    for (int n = 0; n < 500; ++n) {
      const glm::dvec3 point(random.real(0, 19), random.real(0, 16), random.real(0, 14));
      const glm::dvec3 expected = point + gradient * point + glm::dvec3(1, 2, 3);
      ASSERT_LE(glm::length(moved(grid, field, point) - expected), 1e-12);
    }
  }
}

TEST(Points, WhatRestsKeepsItsBits) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed());
  const Geometry grid = oblique_grid({20, 17, 15});
  const VertexField field = uniform_field(lattice_over(grid, 3), glm::vec3(0));
  for (int n = 0; n < 500; ++n) {
    const glm::dvec3 point =
        point_from_index(grid)(glm::dvec3(random.real(0, 19), random.real(0, 16), random.real(0, 14)));
    const glm::dvec3 found = moved(grid, field, point);
    ASSERT_EQ(std::memcmp(&found, &point, sizeof point), 0);
  }
}

TEST(Points, OutsideTheLatticeTheyStayAndOnItsBorderTheyMove) {
  const Geometry grid = oblique_grid({9, 8, 7});
  const AffineMap point = point_from_index(grid), index = index_from_point(grid);
  const VertexField field =
      field_in_voxels(grid, lattice_over(grid, 2), [](const glm::dvec3&) { return glm::dvec3(1, 2, 4); });
  const glm::dvec3 last(field.lattice.size * std::int64_t{2} - std::int64_t{2});
  for (const Outside outside : {Outside::refuse, Outside::rest, Outside::background}) {
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 side(corner & 1, corner >> 1 & 1, corner >> 2), at = side * last;
      const glm::dvec3 found = index(moved(grid, field, point(at), outside));
      EXPECT_LE(glm::length(found - at - glm::dvec3(1, 2, 4)), 1e-3) << corner;
      for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 beyond = at;
        beyond[axis] += side[axis] > 0 ? 0.01 : -0.01;
        const glm::dvec3 before = point(beyond);
        glm::dvec3 after = before;
        EXPECT_EQ(move_points(grid, view(field, outside), {&after, 1})[0], PointStatus::outside);
        EXPECT_EQ(after, before);
      }
    }
  }
  glm::dvec3 nowhere(std::numeric_limits<double>::infinity(), 0, 0);
  EXPECT_EQ(move_points(grid, view(field), {&nowhere, 1})[0], PointStatus::outside);
}

TEST(Points, AnyNumberOfThreadsGivesTheSameBits) {
  Random random(test_seed());
  const FieldCase test = askew_case(random);
  std::vector<glm::dvec3> first;
  for (int n = 0; n < 30000; ++n) {
    first.push_back(test.field.lattice.origin +
                    glm::dvec3(random.real(-30, 30), random.real(-30, 30), random.real(-30, 30)));
  }
  std::vector<glm::dvec3> second = first;
  const auto one = move_points(test.output, view(test.field, Outside::rest), first, {.threads = 1});
  const auto all = move_points(test.output, view(test.field, Outside::rest), second);
  EXPECT_EQ(one, all);
  EXPECT_TRUE(same_bits(first, second));
  EXPECT_GT(std::count(one.begin(), one.end(), PointStatus::moved), 100);
  EXPECT_GT(std::count(one.begin(), one.end(), PointStatus::outside), 100);
}

TEST(Points, FieldsThatVolumesRefuseAreRefused) {
  const Geometry grid = unit_grid({9, 8, 7});
  Geometry half = lattice_over(grid, 1);
  half.size.x = 5;
  glm::dvec3 point(1, 1, 1);
  EXPECT_THROW(move_points(grid, view(uniform_field(half, glm::vec3(1))), {&point, 1}), InputError);
  VertexField broken = uniform_field(lattice_over(grid, 1), glm::vec3(1));
  broken.displacement[0].y = NAN;
  point = {0.25, 0.25, 0.25};
  EXPECT_THROW(move_points(grid, view(broken), {&point, 1}), InputError);
}

TETWARP_BACKEND_SUITE(PointsAndVolumes);

/// What the resampler shows at voxel p came from p + inverse: a point there must go to p.
TEST_P(PointsAndVolumes, APointGoesToTheVoxelThatShowsIt) {
  SCOPED_TRACE(seed_text(test_seed()));
  std::size_t compared = 0;
  for (std::uint64_t number = 0; number < test_cases(40); ++number) {
    Random random(test_seed(), number);
    const FieldCase test = random_injective_case(random);
    SCOPED_TRACE(test.description);
    const auto resampler = make(test.output);
    resampler->set_field(view(test.field, Outside::background));
    const Volume<float> source{test.output,
                               std::vector<float>(static_cast<std::size_t>(voxel_count(test.output)), 1.0f)};
    const auto found = run(*resampler, source);
    const AffineMap point = point_from_index(test.output);
    for_each_voxel(test.output, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (found.owners.voxels[n] != 1 || std::abs(found.jacobian.voxels[n]) < 0.02f) return;
      const glm::dvec3 seen = point(glm::dvec3(voxel));
      glm::dvec3 at = seen + glm::dvec3(found.inverse_mm.voxels[n]);
      const auto status = move_points(test.output, view(test.field, Outside::background), {&at, 1});
      if (status[0] != PointStatus::moved) return;  // owned by the nudged point: just beyond the border
      ++compared;
      ASSERT_LE(length_in_voxels(test.output, at - seen), 1e-2) << to_string(voxel);
    });
  }
  EXPECT_GT(compared, 1000u);
}

/// The middle of what is bright, in mm.
glm::dvec3 middle_of(const Volume<float>& volume) {
  const AffineMap point = point_from_index(volume.geometry);
  glm::dvec3 sum(0);
  double weight = 0;
  for_each_voxel(volume.geometry, [&](const glm::i64vec3& voxel, std::size_t n) {
    sum += static_cast<double>(volume.voxels[n]) * point(glm::dvec3(voxel));
    weight += static_cast<double>(volume.voxels[n]);
  });
  return sum / weight;
}

TEST_P(PointsAndVolumes, ABrightSpotGoesWhereItsLandmarkGoes) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed());
  for (const std::int64_t cell_size : {1, 4, 8}) {
    for (int number = 0; number < 4; ++number) {
      Geometry grid = oblique_grid({48, 44, 40});
      grid.direction = rotation({random.real(-1, 1), random.real(-1, 1), 1}, random.real(-3, 3));
      const double amplitude = random.real(2, 4), phase = random.real(0, 6);
      const VertexField field = field_in_voxels(grid, lattice_over(grid, cell_size), [&](const glm::dvec3& x) {
        return amplitude * glm::dvec3(std::sin(0.07 * x.y + phase), std::cos(0.06 * x.z + phase), std::sin(0.05 * x.x));
      });
      const glm::dvec3 landmark =
          point_from_index(grid)(glm::dvec3(random.real(16, 30), random.real(15, 28), random.real(15, 24)));
      Volume<float> source{grid, {}};
      for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t) {
        const glm::dvec3 from = point_from_index(grid)(glm::dvec3(voxel)) - landmark;
        source.voxels.push_back(static_cast<float>(std::exp(-glm::dot(from, from) / 4)));
      });
      const auto resampler = make(grid);
      resampler->set_field(view(field));
      const auto found = run(*resampler, source, {.background = 0});
      const glm::dvec3 gone = moved(grid, field, landmark);
      EXPECT_LE(length_in_voxels(grid, middle_of(found.output) - gone), 0.1) << "cells of " << cell_size;
      EXPECT_GE(length_in_voxels(grid, gone - landmark), 0.5);
    }
  }
}

}  // namespace
}  // namespace tetwarp
