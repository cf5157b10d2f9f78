// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "deform/geometry.h"

namespace tetwarp {

/// From where a volume is looked at, and how large it appears. Rays are parallel, so a millimetre has the same length
/// everywhere in the picture.
struct Camera {
  /// Degrees around the patient's long axis: 0 from the front, 90 from the patient's left, 180 from behind.
  double angle_deg = 0;
  double elevation_deg = 0;  ///< degrees: 90 from above the head, -90 from below the feet
  double zoom = 1;           ///< magnification; at 1 the whole volume is in the picture
  bool every_angle = false;  ///< whether zoom 1 shows the whole volume at every `angle_deg`, not only at this one
  int width = 512,           ///< columns of the picture, pixels
      height = 512;          ///< rows of the picture, pixels
  std::optional<glm::dvec3> target = {};  ///< LPS mm of the middle of the picture; empty: the middle of the volume
};

/// The pixels of a picture in patient space, and the direction of its rays.
struct ViewPlane {
  glm::dvec3 middle{0};         ///< middle of the picture, LPS mm
  glm::dvec3 right{1, 0, 0},    ///< unit vector in LPS along which columns follow each other
      down{0, 0, -1};           ///< unit vector in LPS along which rows follow each other
  glm::dvec3 forward{0, 1, 0};  ///< unit vector of the rays in LPS, away from the viewer
  double pixel_mm = 1;          ///< side of a pixel, mm
  int width = 1,                ///< columns of the picture, pixels
      height = 1;               ///< rows of the picture, pixels

  /// LPS mm of a place in the picture, given in pixels from its left and upper edge; (0.5, 0.5) is the middle of the
  /// first pixel.
  glm::dvec3 at(double across, double below) const {
    return middle + right * ((across - 0.5 * width) * pixel_mm) + down * ((below - 0.5 * height) * pixel_mm);
  }
  /// A point (LPS mm) as the picture sees it: pixels from the left edge, pixels from the upper edge, and mm behind the
  /// plane.
  glm::dvec3 project(const glm::dvec3& point) const;
  /// Whether pixels and rays are the same.
  friend bool operator==(const ViewPlane&, const ViewPlane&) = default;
};

/// The plane onto which a camera projects a volume.
/// @throws InputError for angles that are not finite, a zoom or a size that is not positive, or more than 2^14 pixels
///         on a side
ViewPlane view_plane(const Camera& camera, const Geometry& volume);

}  // namespace tetwarp
