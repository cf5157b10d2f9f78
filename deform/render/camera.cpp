// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/camera.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>

#include "deform/errors.h"

namespace tetwarp {

namespace {

constexpr int kMostPixels = 1 << 14;
constexpr double kMargin = 1.04;  ///< size of the picture over that of the volume

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

}  // namespace

glm::dvec3 ViewPlane::project(const glm::dvec3& point) const {
  const glm::dvec3 from = point - middle;
  return {0.5 * width + glm::dot(from, right) / pixel_mm, 0.5 * height + glm::dot(from, down) / pixel_mm,
          glm::dot(from, forward)};
}

ViewPlane view_plane(const Camera& camera, const Geometry& volume) {
  require_valid(volume, "volume");
  require(std::isfinite(camera.angle_deg) && std::isfinite(camera.elevation_deg),
          "angle and elevation have to be numbers");
  require(camera.zoom > 0 && std::isfinite(camera.zoom), "zoom has to be above 0");
  require(std::min(camera.width, camera.height) > 0 && std::max(camera.width, camera.height) <= kMostPixels,
          "a picture has 1 to " + std::to_string(kMostPixels) + " pixels on a side");
  const double angle = radians(camera.angle_deg), elevation = radians(camera.elevation_deg);
  const double ca = std::cos(angle), sa = std::sin(angle), ce = std::cos(elevation), se = std::sin(elevation);
  ViewPlane plane;
  plane.middle = camera.target.value_or(centre(volume));
  plane.forward = {-sa * ce, ca * ce, -se};
  plane.right = {ca, sa, 0};
  plane.down = {sa * se, -ca * se, -ce};
  plane.width = camera.width;
  plane.height = camera.height;
  const AffineMap point = point_from_index(volume);
  glm::dvec2 half(0);  // half the size of the volume along right and down, mm
  for (const glm::dvec3& corner :
       {glm::dvec3(1, 1, 1), glm::dvec3(-1, 1, 1), glm::dvec3(1, -1, 1), glm::dvec3(1, 1, -1)}) {
    const glm::dvec3 diagonal = point.linear * (0.5 * corner * glm::dvec3(volume.size));
    const double around = std::hypot(diagonal.x, diagonal.y);
    half.x = std::max(half.x, camera.every_angle ? around : std::abs(glm::dot(diagonal, plane.right)));
    half.y = std::max(half.y, camera.every_angle ? std::abs(diagonal.z * ce) + around * std::abs(se)
                                                 : std::abs(glm::dot(diagonal, plane.down)));
  }
  plane.pixel_mm = kMargin * 2 * std::max(half.x / camera.width, half.y / camera.height) / camera.zoom;
  return plane;
}

}  // namespace tetwarp
