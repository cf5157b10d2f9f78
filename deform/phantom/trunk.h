// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>

#include "deform/phantom/shapes.h"

namespace tetwarp::phantom {

/// Number of levels, each a vertebra with its ribs: level 0 is the first thoracic vertebra, 12 the first lumbar one.
constexpr int kLevels = 14;
constexpr float kLevelPitch = 23.5f;
constexpr float level_z(int level) { return 148.0f - kLevelPitch * static_cast<float>(level); }

/// Where a point lies relative to the walls of the trunk: signed distances in mm, negative inside.
struct Walls {
  float skin;       ///< the body's surface
  float muscle;     ///< outer surface of the muscles, under the fat
  float cage;       ///< inner surface of the ribs and of the abdominal wall
  float diaphragm;  ///< negative below the diaphragm
};

/// Cross-section of a wall at one height: a squircle with `half_width` to either side, from y = front to y = back, mm.
struct Outline {
  float half_width, front, back;
  /// Cosine of the wall's slope along z, which turns a distance within the slice into one in space.
  float tilt = 1;
};

/// The walls of the trunk, which are smooth functions of height, and the lungs and ribs within them.
class Trunk {
 public:
  Trunk();

  Walls walls(Point p) const;
  /// Signed distance to the lungs: inside the cage, above the diaphragm, beside mediastinum and heart.
  float lungs(Point p, const Walls& walls) const;
  struct Rib {
    float distance;
    bool cartilage;
  };
  /// The nearest rib: an oblique band at the outside of the cage that falls from back to front. Near the sternum it is
  /// cartilage.
  Rib rib(Point p, const Walls& walls) const;

 private:
  static constexpr int kHeights = 361;  // z = -180 to 180 in steps of 1 mm
  struct Layers {
    Outline body, muscle, cage;
  };
  Layers layers(float z) const;

  std::array<Layers, kHeights> layers_;
  Ellipsoid heart_;
};

/// Signed distance to the domes of the diaphragm, mm, negative below.
float diaphragm(Point p);

/// The heart with its fat, which presses into the lungs and lies on the diaphragm.
Ellipsoid heart();

/// y of the middle of the vertebral bodies at height z.
float spine_y(float z);

}  // namespace tetwarp::phantom
