// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Contours of structures: distances, zero contours, and solids that are moved and drawn anew.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <tuple>

#include "deform/contours/contour_mover.h"
#include "deform/contours/reslicer.h"
#include "deform/contours/zero_contours.h"
#include "deform/errors.h"
#include "deform/fields/formula.h"
#include "tests/support/fields.h"
#include "tests/support/random.h"

namespace tetwarp {
namespace {

using namespace test;

constexpr double kPi = std::numbers::pi;

Ring circle(const glm::dvec2& middle, double radius, int corners, bool clockwise = false) {
  Ring ring;
  for (int n = 0; n < corners; ++n) {
    const double angle = (clockwise ? -2 : 2) * kPi * n / corners;
    ring.push_back(middle + radius * glm::dvec2(std::cos(angle), std::sin(angle)));
  }
  return ring;
}

Contour drawn(const Ring& ring, double z) {
  Contour contour;
  for (const glm::dvec2& corner : ring) contour.points.emplace_back(corner, z);
  return contour;
}

/// Contours of a ball on slices, with a hole of its own if `inner` is not 0.
std::vector<Contour> ball(const Geometry& slices, const glm::dvec3& middle, double radius, double inner = 0) {
  std::vector<Contour> contours;
  for (std::int64_t k = 0; k < slices.size.z; ++k) {
    const double z = slices.origin.z + slices.spacing.z * static_cast<double>(k), height = z - middle.z;
    for (const double r : {radius, inner}) {
      if (std::abs(height) >= r) continue;
      contours.push_back(drawn(circle(glm::dvec2(middle), std::sqrt(r * r - height * height), 180), z));
    }
  }
  return contours;
}

TEST(PolygonInterior, DistanceIsThatOfTheNearestEdge) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  Ring star;  // its rays do not cross
  for (int n = 0; n < 97; ++n)
    star.push_back(random.real(3, 20) * glm::dvec2(std::cos(2 * kPi * n / 97), std::sin(2 * kPi * n / 97)));
  const PolygonInterior interior({star});
  for (int n = 0; n < 500; ++n) {
    const glm::dvec2 point(random.real(-25, 25), random.real(-25, 25));
    double nearest = INFINITY, turns = 0;
    for (std::size_t c = 0; c < star.size(); ++c) {
      const glm::dvec2 a = star[c] - point, b = star[(c + 1) % star.size()] - point;
      for (int step = 0; step <= 400; ++step) nearest = std::min(nearest, glm::length(a + (b - a) * (step / 400.0)));
      turns += std::atan2(a.x * b.y - a.y * b.x, glm::dot(a, b)) / (2 * kPi);
    }
    const double found = interior.signed_distance(point);
    EXPECT_NEAR(std::abs(found), nearest, 0.05);
    EXPECT_LE(std::abs(found), nearest + 1e-9);
    if (nearest < 1e-6) continue;
    EXPECT_EQ(found > 0, std::abs(turns) > 0.5) << point.x << " " << point.y;
  }
}

TEST(PolygonInterior, ChannelOfAKeyholeIsNoBorder) {
  const std::vector<Ring> rings = joined_by_keyholes({circle({0, 0}, 20, 60), circle({1, 0.3}, 5, 40, true)});
  ASSERT_EQ(rings.size(), 1u);
  const PolygonInterior interior(rings);
  EXPECT_NEAR(interior.signed_distance({13, 0.3}), 7, 0.05);  // on the channel: to the outer circle
  EXPECT_NEAR(interior.signed_distance({13, 0.4}), 7, 0.05);
  EXPECT_NEAR(interior.signed_distance({1, 0.3}), -5, 0.05);
}

TEST(PolygonInterior, TwoEqualRingsLeaveNothing) {
  const PolygonInterior interior({circle({0, 0}, 20, 60), circle({0, 0}, 20, 60)});
  EXPECT_FALSE(interior.contains({1, 2}));
  EXPECT_EQ(interior.signed_distance({1, 2}), -PolygonInterior::kFar);
}

TEST(Keyholes, EachRingAloneIsRight) {
  std::vector<Ring> rings{circle({0, 0}, 20, 80),       circle({-8, 1}, 4, 30, true), circle({8, 1}, 4, 30, true),
                          circle({0, -9}, 3, 30, true), circle({8, 1}, 2, 30),        circle({50, 0}, 5, 30)};
  const std::vector<Ring> before = rings, joined = joined_by_keyholes(rings);
  ASSERT_EQ(joined.size(), 3u);  // the disc with three holes, the island in one of them, the other disc
  for (double x = -24.987; x < 60; x += 1.03) {
    for (double y = -24.981; y < 25; y += 1.07) {
      int around = 0, joined_around = 0;
      for (const Ring& ring : before) around += contains(ring, {x, y});
      for (const Ring& ring : joined) joined_around += contains(ring, {x, y});
      EXPECT_LE(joined_around, 1);
      EXPECT_EQ(joined_around, around % 2) << x << " " << y;
    }
  }
  EXPECT_NEAR(nested_area(joined), nested_area(before), 1e-9);
  // By exclusive or equal rings cancel each other, and what they contain stays.
  const Ring outer = circle({0, 0}, 20, 80), inner = circle({0, 0}, 5, 80);
  EXPECT_EQ(nested_area({outer, outer}), 0);
  EXPECT_EQ(nested_area({outer, outer, outer}), nested_area({outer}));
  EXPECT_NEAR(nested_area({outer, inner, outer}), nested_area({inner}), 1e-9);
}

TEST(Simplified, LeavesWhatIsWithinTheTolerance) {
  const Ring fine = circle({3, 4}, 10, 5000), simple = simplified(fine, 0.01);
  EXPECT_LT(simple.size(), 150u);
  EXPECT_GT(simple.size(), 40u);
  const PolygonInterior interior({simple});
  for (const glm::dvec2& corner : fine) EXPECT_LE(std::abs(interior.signed_distance(corner)), 0.01 + 1e-12);
  EXPECT_EQ(simplified({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {0, 2}}, 0.01), (Ring{{0, 0}, {2, 0}, {2, 2}, {0, 2}}));
}

TEST(ZeroContours, BordersGoCounterclockwiseAndHolesClockwise) {
  std::vector<double> values;
  for (int j = 0; j < 41; ++j)
    for (int i = 0; i < 51; ++i) {
      const double from = glm::distance(glm::dvec2(i, j), glm::dvec2(25.3, 19.8));
      values.push_back(std::min(15 - from, from - 6));
    }
  const ZeroContours zero = zero_contours(values, 51, 41);
  ASSERT_EQ(zero.rings.size(), 2u);
  EXPECT_FALSE(zero.cut);
  EXPECT_NEAR(signed_area(zero.rings[0]), kPi * 225, 1);
  EXPECT_NEAR(signed_area(zero.rings[1]), -kPi * 36, 1);
  for (const glm::dvec2& corner : zero.rings[0]) EXPECT_NEAR(glm::distance(corner, glm::dvec2(25.3, 19.8)), 15, 0.02);
}

TEST(ZeroContours, TheMeanDecidesWhetherCornersAreJoined) {
  const auto rings = [](double other) {
    std::vector<double> values(16, -1);
    values[5] = values[10] = 2;
    values[6] = values[9] = other;
    return zero_contours(values, 4, 4).rings.size();
  };
  EXPECT_EQ(rings(-1), 1u);
  EXPECT_EQ(rings(-3), 2u);
}

TEST(ZeroContours, WhatIsCutIsClosedAndSaid) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const ZeroContours border = zero_contours(std::vector<double>(12, 1.0), 4, 3);
  ASSERT_EQ(border.rings.size(), 1u);
  EXPECT_TRUE(border.cut);
  EXPECT_NEAR(signed_area(border.rings[0]), 4 * 3 - 0.5, 1e-12);  // its corners are cut
  const ZeroContours hole = zero_contours(std::vector<double>{-1, -1, -1, -1, 1, nan, -1, -1, -1}, 3, 3);
  EXPECT_EQ(hole.rings.size(), 1u);
  EXPECT_TRUE(hole.cut);
}

Geometry slices_grid() { return {{64, 60, 30}, {1, 1, 3}, {-32, -30, -45}, glm::dmat3(1)}; }

TEST(ContourStack, VolumeOfABall) {
  const ContourStack stack(ball(slices_grid(), {0, 0, 0}, 24, 10), slices_grid());
  EXPECT_NEAR(stack.volume(), 4 * kPi / 3 * (24 * 24 * 24 - 10 * 10 * 10), 0.01 * stack.volume());
  EXPECT_EQ(stack.parts(), 1u);
  EXPECT_NEAR(stack.signed_distance({17, 0, 0}, Between::interpolated), 7, 0.02);
  EXPECT_NEAR(stack.signed_distance({0, 3, 0}, Between::interpolated), -7, 0.02);
}

TEST(ContourStack, NothingIsBetweenPlanesThatAreFarApart) {
  std::vector<Contour> contours;
  for (const double z : {0.0, 3.0, 6.0, 30.0, 33.0}) contours.push_back(drawn(circle({0, 0}, 10, 60), z));
  const ContourStack stack(contours, slices_grid());
  EXPECT_EQ(stack.parts(), 2u);
  for (const auto& [z, inside] : {std::pair(-1.6, false),
                                  {-1.4, true},
                                  {4.5, true},
                                  {7.4, true},
                                  {7.6, false},
                                  {18.0, false},
                                  {28.6, true},
                                  {34.4, true},
                                  {34.6, false}}) {
    for (const Between between : {Between::interpolated, Between::nearest})
      EXPECT_EQ(stack.signed_distance({1, 2, z}, between) >= 0, inside) << z;
    EXPECT_EQ(stack.is_inside({1, 2, z}).interpolated, inside) << z;
    EXPECT_EQ(stack.is_inside({1, 2, z}).nearest, inside) << z;
  }
}

TEST(ContourStack, NeighboursOnUnevenSlicesHaveSomethingBetweenThem) {
  Geometry uneven = slices_grid();
  uneven.size.z = 6;
  uneven.origin.z = 0;
  uneven.slices = {0, 3, 6, 15, 18, 21};
  uneven.spacing.z = 21.0 / 5;
  std::vector<Contour> contours;
  for (const double z : uneven.slices) contours.push_back(drawn(circle({0, 0}, 10, 60), z));
  EXPECT_EQ(ContourStack(contours, uneven).parts(), 1u);
  EXPECT_TRUE(ContourStack(contours, uneven).is_inside({1, 2, 10.4}).interpolated);
  contours.erase(contours.begin() + 3);
  EXPECT_EQ(ContourStack(contours, uneven).parts(), 2u);
}

TEST(ContourStack, AnEndHalfWayToASliceBelongsToOneOfTwoSlices) {
  std::vector<Contour> contours;
  for (const double z : {0.0, 3.0, 6.0}) contours.push_back(drawn(circle({0, 0}, 10, 60), z));
  const ContourStack stack(contours, slices_grid());
  int inside = 0;
  for (double z = -10.5; z < 20; z += 3) inside += stack.is_inside({0, 0, z}).interpolated;
  EXPECT_EQ(inside, 3);
}

TEST(ContourStack, TakesTheContoursOwnPlanesButNotSeveralKinds) {
  const auto turned = [](const Contour& contour) {
    Contour result = contour;
    for (glm::dvec3& point : result.points) point = {point.z, point.x, point.y};
    return result;
  };
  std::vector<Contour> sagittal, mixed;
  for (const Contour& contour : ball(slices_grid(), {0, 0, 0}, 20)) sagittal.push_back(turned(contour));
  const ContourStack stack(sagittal, slices_grid());
  EXPECT_NEAR(stack.volume(), 4 * kPi / 3 * 8000, 0.01 * stack.volume());
  std::erase_if(sagittal, [](const Contour& contour) { return std::abs(contour.points[0].x) < 5; });
  EXPECT_EQ(ContourStack(sagittal, slices_grid()).parts(), 2u);
  mixed = ball(slices_grid(), {0, 0, 0}, 20);
  mixed.push_back(sagittal[sagittal.size() / 2]);
  EXPECT_THROW(ContourStack(mixed, slices_grid()), InputError);
}

/// A field of the formula on a lattice as fine as the grid, and its inverse at every voxel.
struct Warp {
  Geometry grid;
  VertexField field;
  AnyVolume inverse;
  PointMover mover;

  Warp(const Geometry& on, const std::string& formula, Outside outside = Outside::background)
      : grid(on), field(field_of(formula)), inverse(on, VoxelType::f32, 3), mover(grid, view(field, outside)) {
    const auto resampler = make_cpu_resampler(grid);
    resampler->set_field(view(field, outside));
    resampler->resample(whole(grid), {}, {.inverse_mm = inverse.view()});
  }

 private:
  VertexField field_of(const std::string& formula) const {
    const PointMap map = parse_formula(formula, grid);
    const AffineMap point = point_from_index(grid), index = index_from_point(grid);
    return field_in_voxels(grid, lattice_over(grid, 1),
                           [&](const glm::dvec3& at) { return index.linear * map(point(at)); });
  }
};

SlicedContours drawn_anew(const Reslicer& reslicer, const Warp& warp, double& volume,
                          Between between = Between::interpolated) {
  SlicedContours all;
  for (std::int64_t k = 0; k < warp.grid.size.z; ++k) {
    const SlicedContours one = reslicer.slice(std::as_const(warp.inverse).view(), k)[static_cast<std::size_t>(between)];
    all.contours.insert(all.contours.end(), one.contours.begin(), one.contours.end());
    all.area += one.area;
    all.cut = all.cut || one.cut;
  }
  volume = all.area * warp.grid.spacing.z;
  return all;
}

TEST(ContourMover, IdentityKeepsEveryPoint) {
  const Warp warp(slices_grid(), "identity");
  const std::vector<Contour> contours = ball(warp.grid, {0, 0, 0}, 20, 8);
  const auto moved = ContourMover(warp.mover, warp.grid).move_within_slices(contours, warp.grid, Outside::background);
  ASSERT_TRUE(moved.has_value());
  ASSERT_EQ(moved->size(), contours.size());
  for (std::size_t n = 0; n < contours.size(); ++n) {
    EXPECT_EQ((*moved)[n].contour.points, contours[n].points);
    ASSERT_TRUE((*moved)[n].contour.slice.has_value());
    EXPECT_EQ(-45 + 3.0 * static_cast<double>(*(*moved)[n].contour.slice), contours[n].points[0].z);
  }
}

TEST(ContourMover, EdgesFollowTheField) {
  const Warp warp(slices_grid(), "wave:amplitude=4,wavelength=30,axis=y,along=x");
  const PointMap wave = parse_formula("wave:amplitude=4,wavelength=30,axis=y,along=x", warp.grid);
  const Contour square = drawn({{-20, -12}, {20, -12}, {20, 12}, {-20, 12}}, 0);
  const MovedContour moved = ContourMover(warp.mover, warp.grid).move(square);
  Ring ring;
  for (const glm::dvec3& point : moved.contour.points) ring.emplace_back(point);
  EXPECT_GT(ring.size(), 10u);
  EXPECT_LT(ring.size(), 60u);
  const PolygonInterior interior({ring});
  for (double x = -20; x < 20; x += 0.37) {
    const glm::dvec3 at(x, 12, 0), to = at + wave(at);
    EXPECT_LT(std::abs(interior.signed_distance(glm::dvec2(to))), 0.16) << x;  // a tenth of a voxel, and the lattice's
  }
}

TEST(ContourMover, SlicesThatAreNoLongerSlicesAreNotTaken) {
  const std::vector<Contour> contours = ball(slices_grid(), {0, 0, 0}, 20);
  for (const auto& [formula, taken] : {std::pair("translate:by=1.3/-2.7/6", true),
                                       {"translate:by=0/0/1.5", false},
                                       {"wave:amplitude=3,wavelength=60,axis=x,along=z", true},
                                       {"wave:amplitude=3,wavelength=60,axis=z,along=x", false},
                                       {"wave:amplitude=3,wavelength=60,axis=z,along=z", false},
                                       {"twist:angle=20", true}}) {
    const Warp warp(slices_grid(), formula);
    const auto moved = ContourMover(warp.mover, warp.grid).move_within_slices(contours, warp.grid, Outside::background);
    EXPECT_EQ(moved.has_value(), taken) << formula;
    if (!moved) continue;
    for (const MovedContour& one : *moved) EXPECT_EQ(one.contour.slice, slice_of(one.contour.points, warp.grid));
  }
}

TEST(ContourMover, PointsThatTheFieldDoesNotReachAreNotTaken) {
  const std::vector<Contour> beyond{drawn({{0, 0}, {50, 0}, {50, 20}, {0, 20}}, 0)};
  for (const auto& [formula, outside, taken] : {std::tuple("identity", Outside::background, true),
                                                {"twist:angle=20", Outside::background, false},
                                                {"twist:angle=20", Outside::rest, true}}) {
    const Warp warp(slices_grid(), formula, outside);
    EXPECT_EQ(ContourMover(warp.mover, warp.grid).move_within_slices(beyond, warp.grid, outside).has_value(), taken)
        << formula;
  }
}

/// Every point that was drawn comes from the surface of the solid, and lies in the plane of its slice.
TEST(Reslicer, DrawsTheSurfaceOfTheDeformedBall) {
  for (const std::string formula : {"wave:amplitude=5,wavelength=80,axis=z,along=x", "bubble:radius=28,strength=0.4",
                                    "translate:by=0.4/0.3/1.1", "identity"}) {
    SCOPED_TRACE(formula);
    const Warp warp(slices_grid(), formula);
    const std::vector<Contour> contours = ball(warp.grid, {1, 2, 0}, 20, 9);
    const Reslicer reslicer(contours, warp.grid, warp.grid);
    double volume = 0, determinants = 0;
    const SlicedContours all = drawn_anew(reslicer, warp, volume);
    EXPECT_FALSE(all.cut);
    const PointMap map = parse_formula(formula, warp.grid);
    double worst = 0;
    for (const Contour& contour : all.contours) {
      ASSERT_TRUE(contour.slice.has_value());
      EXPECT_EQ(slice_of(contour.points, warp.grid), contour.slice);
      for (const glm::dvec3& point : contour.points) {
        glm::dvec3 from = point;  // found by fixed-point iteration, which is other mathematics than the inverse map's
        for (int n = 0; n < 60; ++n) from = point - map(from);
        worst = std::max(worst, std::abs(reslicer.solid().signed_distance(from, Between::interpolated)));
      }
    }
    EXPECT_LT(worst, 0.25);
    // The source's volume, each part by the determinant there.
    const double h = 0.5;
    for (double z = -24; z < 24; z += h)
      for (double y = -24; y < 24; y += h)
        for (double x = -24; x < 24; x += h) {
          const glm::dvec3 at(x + 0.1, y + 0.2, z + 0.3);
          if (!reslicer.solid().is_inside(at).interpolated) continue;
          glm::dmat3 jacobian(1);
          for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 step(0);
            step[axis] = 0.01;
            jacobian[axis] += (map(at + step) - map(at - step)) / 0.02;
          }
          determinants += glm::determinant(jacobian) * h * h * h;
        }
    EXPECT_NEAR(volume, determinants, 0.01 * determinants);
  }
}

TEST(Reslicer, SaysWhatIsCutOff) {
  const Warp warp(slices_grid(), "translate:by=20/0/0");
  double volume = 0;
  EXPECT_TRUE(drawn_anew(Reslicer(ball(warp.grid, {0, 0, 0}, 20), warp.grid, warp.grid), warp, volume).cut);
  EXPECT_FALSE(drawn_anew(Reslicer(ball(warp.grid, {-5, 0, 0}, 10), warp.grid, warp.grid), warp, volume).cut);
}

TEST(Reslicer, SmallSolidsKeepTheirVolume) {
  const Warp warp(slices_grid(), "wave:amplitude=4,wavelength=100,axis=z,along=x");
  std::vector<Contour> rod;  // 3 mm thick
  for (int k = 6; k < 24; ++k) rod.push_back(drawn(circle({2.3, 1.7}, 1.5, 24), -45 + 3.0 * k));
  const Reslicer reslicer(rod, warp.grid, warp.grid);
  double volume = 0;
  drawn_anew(reslicer, warp, volume);
  EXPECT_NEAR(volume, reslicer.solid().volume(), 0.03 * volume);
}

TEST(Reslicer, NearestContoursKeepWhatInterpolationLoses) {
  const Warp warp(slices_grid(), "translate:by=0/0/1.5");
  std::vector<Contour> slant;  // each contour hardly overlaps the next
  for (int k = 8; k < 22; ++k) slant.push_back(drawn(circle({-20 + 2.7 * (k - 8), 0}, 1.5, 24), -45 + 3.0 * k));
  const Reslicer reslicer(slant, warp.grid, warp.grid);
  double interpolated = 0, nearest = 0;
  drawn_anew(reslicer, warp, interpolated);
  drawn_anew(reslicer, warp, nearest, Between::nearest);
  EXPECT_LT(interpolated, 0.5 * reslicer.solid().volume());
  EXPECT_NEAR(nearest, reslicer.solid().volume(), 0.02 * nearest);
}

}  // namespace
}  // namespace tetwarp
