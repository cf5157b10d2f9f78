// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/camera.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "deform/errors.h"
#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using test::oblique_grid;
using test::unit_grid;

constexpr double kAngles[] = {0, 30, 90, 145, 180, 270, -60};
constexpr double kElevations[] = {0, 25, 90, -90, -40};

/// Corners of the box that the voxels fill.
std::vector<glm::dvec3> corners_of(const Geometry& grid) {
  const AffineMap point = point_from_index(grid);
  std::vector<glm::dvec3> corners;
  for (int n = 0; n < 8; ++n)
    corners.push_back(point(glm::dvec3(n & 1, n >> 1 & 1, n >> 2 & 1) * glm::dvec3(grid.size) - 0.5));
  return corners;
}

TEST(Camera, LooksFromTheFrontAtFirstWithThePatientsRightOnTheLeftAndTheHeadUp) {
  const ViewPlane plane = view_plane({}, unit_grid({20, 30, 40}));
  EXPECT_NEAR(glm::distance(plane.forward, glm::dvec3(0, 1, 0)), 0, 1e-12);  // towards posterior
  EXPECT_NEAR(glm::distance(plane.right, glm::dvec3(1, 0, 0)), 0, 1e-12);    // towards the patient's left
  EXPECT_NEAR(glm::distance(plane.down, glm::dvec3(0, 0, -1)), 0, 1e-12);    // towards the feet
}

TEST(Camera, GoesAroundByThePatientsLeftAndUpOverTheHead) {
  const Geometry grid = unit_grid({20, 30, 40});
  const auto forward = [&](double angle, double elevation) {
    return view_plane({.angle_deg = angle, .elevation_deg = elevation}, grid).forward;
  };
  EXPECT_NEAR(glm::distance(forward(90, 0), glm::dvec3(-1, 0, 0)), 0, 1e-12);   // from the left to the right
  EXPECT_NEAR(glm::distance(forward(180, 0), glm::dvec3(0, -1, 0)), 0, 1e-12);  // from behind
  EXPECT_NEAR(glm::distance(forward(0, 90), glm::dvec3(0, 0, -1)), 0, 1e-12);   // from above
  EXPECT_NEAR(glm::distance(forward(0, -90), glm::dvec3(0, 0, 1)), 0, 1e-12);
}

TEST(Camera, AxesAreARightHandedFrameAtEveryAngle) {
  for (const double angle : kAngles) {
    for (const double elevation : kElevations) {
      const ViewPlane plane = view_plane({.angle_deg = angle, .elevation_deg = elevation}, oblique_grid({20, 30, 40}));
      EXPECT_NEAR(glm::distance(glm::cross(plane.right, plane.down), plane.forward), 0, 1e-12);
      EXPECT_NEAR(glm::length(plane.right), 1, 1e-12);
    }
  }
}

TEST(Camera, TheWholeVolumeIsInThePictureAndFillsItInOneDirection) {
  for (const Geometry& grid : {unit_grid({20, 30, 40}), unit_grid({100, 10, 3}), oblique_grid({20, 30, 40})}) {
    for (const double angle : kAngles) {
      for (const double elevation : kElevations) {
        const ViewPlane plane =
            view_plane({.angle_deg = angle, .elevation_deg = elevation, .width = 300, .height = 200}, grid);
        double across = 0, below = 0;
        for (const glm::dvec3& corner : corners_of(grid)) {
          const glm::dvec3 at = plane.project(corner);
          across = std::max(across, std::abs(at.x - 150) / 150);
          below = std::max(below, std::abs(at.y - 100) / 100);
        }
        EXPECT_LT(std::max(across, below), 1) << angle << ", " << elevation;
        EXPECT_GT(std::max(across, below), 0.95) << angle << ", " << elevation;
      }
    }
  }
}

TEST(Camera, WhatTurnsKeepsItsScale) {
  const Geometry grid = unit_grid({100, 10, 30});
  const double scale = view_plane({.every_angle = true}, grid).pixel_mm;
  for (const double angle : kAngles)
    EXPECT_NEAR(view_plane({.angle_deg = angle, .every_angle = true}, grid).pixel_mm, scale, 1e-9);
  EXPECT_GE(scale, view_plane({.angle_deg = 5.7}, grid).pixel_mm * (1 - 1e-9));
  EXPECT_NEAR(view_plane({.zoom = 4, .every_angle = true}, grid).pixel_mm, scale / 4, 1e-9);
}

TEST(Camera, ProjectsBackWhatItPlaced) {
  const ViewPlane plane = view_plane({.angle_deg = 33, .elevation_deg = 12}, oblique_grid({20, 30, 40}));
  const glm::dvec3 at = plane.project(plane.at(17.25, 400.5) + plane.forward * 9.0);
  EXPECT_NEAR(at.x, 17.25, 1e-9);
  EXPECT_NEAR(at.y, 400.5, 1e-9);
  EXPECT_NEAR(at.z, 9, 1e-9);
}

TEST(Camera, RefusesWhatIsNoView) {
  const Geometry grid = unit_grid({20, 30, 40});
  EXPECT_THROW(view_plane({.angle_deg = NAN}, grid), InputError);
  EXPECT_THROW(view_plane({.zoom = 0}, grid), InputError);
  EXPECT_THROW(view_plane({.width = 0}, grid), InputError);
  EXPECT_THROW(view_plane({.height = 1 << 15}, grid), InputError);
}

}  // namespace
}  // namespace tetwarp
