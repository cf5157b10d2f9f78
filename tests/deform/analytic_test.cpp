// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "tests/support/backends.h"
#include "tests/support/oracle.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Analytic);

/// Voxels: half a step of snapping in each vertex, and float arithmetic.
constexpr double kRounding = 4e-4;

/// Every voxel of a map that is affine within each slice, with cells of one voxel, against its inverse: x0 to rounding,
/// one owner where x0 is inside the lattice, none where it is not.
template <class Forward, class Inverse>
void expect_exact_inverse(ForwardResampler& resampler, Forward&& forward, Inverse&& inverse) {
  const Geometry& grid = resampler.output();
  const VertexField field =
      field_in_voxels(grid, lattice_over(grid, 1), [&](const glm::dvec3& x) { return forward(x) - x; });
  resampler.set_field(view(field));
  Volume<float> ramp{grid, {}};
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t) {
    ramp.voxels.push_back(static_cast<float>(v.x + 3 * v.y - 2 * v.z));
  });
  const auto found = run(resampler, ramp);
  const glm::dvec3 last(grid.size - std::int64_t{1});
  std::size_t inside = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    const glm::dvec3 x = inverse(glm::dvec3(voxel)), room = glm::min(x, last - x);
    const double depth = std::min({room.x, room.y, room.z});
    if (std::abs(depth) > kRounding) {
      ASSERT_EQ(found.owners.voxels[n], depth > 0) << to_string(voxel);
    }
    if (found.owners.voxels[n] == 0) return;
    ++inside;
    const glm::dvec3 error = glm::dvec3(voxel) + glm::dvec3(found.inverse_mm.voxels[n]) - x;
    ASSERT_LE(glm::length(error), kRounding) << to_string(voxel);
    ASSERT_NEAR(found.output.voxels[n], x.x + 3 * x.y - 2 * x.z, 6 * kRounding) << to_string(voxel);
  });
  EXPECT_GT(inside, ramp.voxels.size() / 2);
  EXPECT_EQ(found.report.inverted + found.report.degenerate, 0u);
}

TEST_P(Analytic, WaveIsItsClosedFormInverse) {
  for (int axis = 0; axis < 3; ++axis) {
    const Geometry grid = unit_grid({31, 30, 29});
    const glm::dvec3 middle = centre(grid);
    const auto resampler = make(grid);
    for (int along = 0; along < 3; ++along) {
      if (along == axis) continue;
      const auto wave = [&](const glm::dvec3& x, double amplitude) {
        glm::dvec3 moved = x;
        moved[axis] += amplitude * std::sin(2 * std::numbers::pi * (x[along] - middle[along]) / 23 + 0.3);
        return moved;
      };
      SCOPED_TRACE("axis " + std::to_string(axis) + " along " + std::to_string(along));
      expect_exact_inverse(
          *resampler, [&](const glm::dvec3& x) { return wave(x, 5); },
          [&](const glm::dvec3& x) { return wave(x, -5); });
    }
  }
}

TEST_P(Analytic, TwistIsItsClosedFormInverse) {
  for (const glm::i64vec3& size : {glm::i64vec3(31, 31, 21), glm::i64vec3(30, 26, 22)}) {
    const Geometry grid = unit_grid(size);
    const glm::dvec3 middle = centre(grid);
    const auto twist = [&](const glm::dvec3& x, double angle) {
      const glm::dvec3 d = x - middle;
      return middle + rotation({0, 0, 1}, angle * d.z / middle.z) * d;
    };
    const auto resampler = make(grid);
    for (const double angle : {0.5, -1.2, std::numbers::pi / 2}) {
      SCOPED_TRACE("angle " + std::to_string(angle));
      expect_exact_inverse(
          *resampler, [&](const glm::dvec3& x) { return twist(x, angle); },
          [&](const glm::dvec3& x) { return twist(x, -angle); });
    }
  }
}

/// Bubble's profile: the radius to which r moves.
double bubble_radius(double r, double radius, double strength) {
  if (r >= radius) return r;
  const double rest = 1 - r / radius;
  return (1 + strength * rest * rest) * r;
}

/// The radius that moves to `r`, by bisection: the profile rises.
double inverse_bubble_radius(double r, double radius, double strength) {
  double low = 0, high = std::max(r, radius);
  for (int step = 0; step < 100; ++step) {
    const double middle = 0.5 * (low + high);
    (bubble_radius(middle, radius, strength) < r ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double bubble_error(ForwardResampler& resampler, std::int64_t cell, double strength) {
  const Geometry& grid = resampler.output();
  const glm::dvec3 middle = centre(grid);
  constexpr double kRadius = 20;
  const VertexField field = field_in_voxels(grid, lattice_over(grid, cell), [&](const glm::dvec3& x) {
    const double r = glm::length(x - middle);
    return r == 0 ? glm::dvec3(0) : (bubble_radius(r, kRadius, strength) / r - 1) * (x - middle);
  });
  resampler.set_field(view(field));
  const auto found =
      run(resampler, Volume<float>{grid, std::vector<float>(static_cast<std::size_t>(voxel_count(grid)))});
  EXPECT_EQ(found.report.uncovered, 0u);
  EXPECT_EQ(found.report.multiply_owned, 0u);
  double squares = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    const glm::dvec3 d = glm::dvec3(voxel) - middle;
    const double r = glm::length(d);
    const glm::dvec3 exact = r == 0 ? glm::dvec3(0) : (inverse_bubble_radius(r, kRadius, strength) / r - 1) * d;
    const glm::dvec3 error = glm::dvec3(found.inverse_mm.voxels[n]) - exact;
    squares += glm::dot(error, error);
  });
  return std::sqrt(squares / static_cast<double>(voxel_count(grid)));
}

TEST_P(Analytic, BubblesErrorFallsWithTheSquareOfTheCellSize) {
  const Geometry grid = unit_grid({49, 49, 49});
  const auto resampler = make(grid);
  for (const double strength : {0.6, -0.4}) {
    const double error8 = bubble_error(*resampler, 8, strength), error4 = bubble_error(*resampler, 4, strength),
                 error2 = bubble_error(*resampler, 2, strength), error1 = bubble_error(*resampler, 1, strength);
    SCOPED_TRACE("strength " + std::to_string(strength) + ": rms error " + std::to_string(error8) + ", " +
                 std::to_string(error4) + ", " + std::to_string(error2) + ", " + std::to_string(error1) + " voxels");
    EXPECT_NEAR(error8 / error4, 4, 1);
    EXPECT_NEAR(error4 / error2, 4, 0.7);
    EXPECT_NEAR(error2 / error1, 4, 0.7);
    EXPECT_LT(error1, 0.01);
  }
}

TEST_P(Analytic, ThePapersBubbleTearsOpenOrFoldsAsTheOracleSays) {
  for (const glm::i64vec3& size : {glm::i64vec3(17, 17, 17), glm::i64vec3(16, 15, 16)}) {
    const Geometry grid = unit_grid(size);
    const glm::dvec3 middle = centre(grid);
    const auto resampler = make(grid);
    for (const double shift : {4.5, -4.5}) {
      const VertexField field = field_in_voxels(grid, lattice_over(grid, 1), [&](const glm::dvec3& x) {
        const glm::dvec3 d = x - middle;
        return d == glm::dvec3(0) ? d : shift / glm::length(d) * d;
      });
      resampler->set_field(view(field));
      Random random(1);
      const auto found = run(*resampler, random_values<float>(grid, random, 0, 1));
      const Oracle oracle(grid, field);
      for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
        ASSERT_EQ(found.owners.voxels[n], oracle.owners(voxel).count) << to_string(voxel);
      });
      EXPECT_EQ(found.report.inverted, oracle.inverted);
      EXPECT_EQ(found.report.multiply_owned, oracle.multiply_owned);
      EXPECT_EQ(*found.report.multiply_owned > 0, shift < 0);
      EXPECT_EQ(found.report.inverted > 0, shift < 0);
      EXPECT_GT(found.report.jacobian_max, shift > 0 ? 8 : 1);
    }
  }
}

}  // namespace
}  // namespace tetwarp
