// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>

#include "deform/phantom/shapes.h"

namespace tetwarp::phantom {

/// Heights of the vertebrae and of their ribs: level 0 is the first thoracic vertebra, 12 the first lumbar one.
constexpr int kLevels = 14;
constexpr float kLevelPitch = 23.5f;
constexpr float level_z(int level) { return 148.0f - kLevelPitch * static_cast<float>(level); }

/// What a point of the trunk is relative to its walls: signed distances in mm, negative inside.
struct Walls {
  float skin;       ///< the body's surface
  float muscle;     ///< outside of the muscles, under the fat
  float cage;       ///< inside of the ribs and of the abdominal wall
  float diaphragm;  ///< negative below
};

/// Cross-section of a wall at one height: a squircle, half_width to either side, from y = front to y = back.
struct Outline {
  float half_width, front, back;
  float tilt = 1;  ///< cosine of the wall's slope along z: turns a distance in the slice into one in space
};

/// The walls of the trunk, smooth functions of height, and what is cut from them: lungs and ribs.
class Trunk {
 public:
  Trunk();

  Walls walls(Point p) const;
  /// Both lungs: inside the cage, above the diaphragm, beside mediastinum and heart.
  float lungs(Point p, const Walls& walls) const;
  struct Rib {
    float distance;
    bool cartilage;
  };
  /// The nearest rib: an oblique band of the cage's outside, falling from back to front; cartilage near the sternum.
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

/// Distance to the diaphragm's domes, negative below.
float diaphragm(Point p);

/// The heart with its fat, which presses into the lungs and rests on the diaphragm.
Ellipsoid heart();

/// y of the middle of the vertebral bodies at height z.
float spine_y(float z);

}  // namespace tetwarp::phantom
