// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <span>
#include <vector>

#include "deform/contours/contour.h"
#include "deform/contours/polygon_interior.h"
#include "deform/geometry.h"

namespace tetwarp {

/// Largest distance, mm, of points that lie in one plane. Coordinates of drawn contours are written with two decimals
/// or more.
constexpr double kInPlane = 0.05;

/// How the solid between two planes of contours is found.
enum class Between : std::uint8_t {
  interpolated,  ///< signed distances change linearly (shape-based interpolation: Raya and Udupa, IEEE Trans. Med.
                 ///< Imaging 9, 1990)
  nearest        ///< what is in the nearer plane
};

/// A solid that is drawn as closed contours in parallel planes.
///
/// In a plane the solid is what an odd number of contours surround. Planes further apart than 1.5 times what is usual
/// for them (the median) have nothing between them if a slice without contours is there: there the solid ends. At an
/// end it goes on unchanged for half the usual distance; a plane that lies exactly there is inside at the lower end
/// alone, by a hundredth of the distance.
class ContourStack {
 public:
  /// @param contours  others than closed ones are passed over, and so are those of fewer than three points
  /// @param slices    grid of the images that they were drawn on; contours in other planes than these are taken too
  /// @throws InputError unless the contours lie in planes, all parallel
  ContourStack(std::span<const Contour> contours, const Geometry& slices);

  /// Signed distance from the surface, mm: positive inside; near the surface exact or smaller in size; -infinity where
  /// there is nothing.
  double signed_distance(const glm::dvec3& point, Between between) const;
  /// Whether a point is inside, for each kind of Between. It is much faster than `signed_distance`.
  struct Inside {
    bool interpolated = false, nearest = false;
  };
  Inside is_inside(const glm::dvec3& point) const;
  /// Volume in mm3: the area in each plane times half the distance between its two neighbours.
  double volume() const;
  /// Usual (median) distance of neighbouring planes, mm.
  double distance() const { return distance_; }
  /// Number of runs of planes that have something between them.
  std::size_t parts() const { return parts_.size(); }

 private:
  struct Plane {
    double at;  ///< mm along the normal
    PolygonInterior interior;
    double area;
  };
  struct Part {
    std::size_t first, last;  ///< planes
    double begin, end;        ///< mm along the normal
  };

  void choose_frame(std::span<const Contour> contours, const glm::dvec3& normal);
  void add_planes(std::span<const Contour> contours);
  void add_parts(const Geometry& slices);
  /// The planes of a part below and above a height, and how far the height is from the lower to the upper one, 0 to 1.
  struct Neighbours {
    const PolygonInterior *below, *above;
    double t;
  };
  Neighbours neighbours(const Part& part, double z) const;

  glm::dmat3 frame_from_point_{1};  ///< two axes of the planes, and their normal
  std::vector<Plane> planes_;       ///< rising
  std::vector<Part> parts_;         ///< rising
  double distance_ = 0;
};

}  // namespace tetwarp
