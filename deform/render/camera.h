// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "deform/geometry.h"

namespace tetwarp {

/// From where a volume is looked at, around its middle, and how large. Parallel rays: a millimetre is as long
/// everywhere in the picture.
struct Camera {
  double angle_deg = 0;  ///< around the patient's long axis: 0 from the front, 90 from the patient's left, 180 behind
  double elevation_deg = 0;               ///< 90 from above the head, -90 from below the feet
  double zoom = 1;                        ///< 1: the whole volume is in the picture
  bool every_angle = false;               ///< so that it is in the picture at all angles
  int width = 512, height = 512;          ///< pixels
  std::optional<glm::dvec3> target = {};  ///< LPS mm of what is in the middle; nothing: the volume's middle
};

/// The pixels of a picture in space, and the direction in which its rays go.
struct ViewPlane {
  glm::dvec3 middle{0};                       ///< LPS mm of the middle of the picture
  glm::dvec3 right{1, 0, 0}, down{0, 0, -1};  ///< unit vectors of the picture's sides, LPS
  glm::dvec3 forward{0, 1, 0};                ///< unit vector of the rays, away from the viewer
  double pixel_mm = 1;
  int width = 1, height = 1;

  /// LPS mm of a place of the picture, in pixels from the left and upper edge; (0.5, 0.5) is the first pixel's middle.
  glm::dvec3 at(double across, double below) const {
    return middle + right * ((across - 0.5 * width) * pixel_mm) + down * ((below - 0.5 * height) * pixel_mm);
  }
  /// Pixels from the left and upper edge, and mm behind the plane, of a point.
  glm::dvec3 project(const glm::dvec3& point) const;
};

/// @throws InputError for angles that are not finite, a zoom or a size of nothing, or more than 2^14 pixels on a side
ViewPlane view_plane(const Camera& camera, const Geometry& volume);

}  // namespace tetwarp
