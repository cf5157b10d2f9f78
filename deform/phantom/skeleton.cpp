// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/phantom/anatomy.h"

namespace tetwarp::phantom {

namespace {

constexpr float kCortical = 1100, kMarrow = 210, kDisc = 85, kCanal = 15, kCord = 38;

/// Adds bones that touch and share their marrow: all of the outsides are painted first, then all of the insides.
void add_bones(std::vector<Organ>& organs, const std::vector<Shape>& bones, float cortex_mm, float cortical = kCortical,
               float marrow = kMarrow) {
  GroupLabels groups(organs);
  for (const Shape& bone : bones) organs.push_back({bone, cortical});
  for (const Shape& bone : bones) organs.push_back({bone, marrow, Within::everything, -cortex_mm});
  groups.are(PhantomLabel::bone);
}

/// Shapes of a vertebra: body, pedicles, laminae, transverse and spinous processes; in the chest also the necks of its
/// ribs.
std::vector<Shape> vertebra(int level) {
  const float size = 1 + 0.022f * static_cast<float>(level - 4), z = level_z(level), y = spine_y(z);
  const auto at = [&](float x, float dy, float dz) { return Point(x * size, y + dy * size, z + dz); };
  const float droop = level < 11 ? -17.0f : -3.0f;  // degrees: thoracic spinous processes point down, lumbar ones back
  std::vector<Shape> bones = {Puck{at(0, 0, 0), {18 * size, 14 * size, 9.2f}, 0.11f},
                              Rod{at(0, 29, 0), at(0, 45, droop), 3.2f, 3.6f}};
  for (const float side : {-1.0f, 1.0f}) {
    bones.push_back(Rod{at(side * 12, 9, 3), at(side * 13, 22, 2), 3.8f, 4.2f});
    bones.push_back(Rod{at(side * 13, 22, 2), at(0, 31, -1), 3.8f, 3.2f});
    const float reach = level < 11 ? 29.0f : 37.0f;
    bones.push_back(Rod{at(side * 13, 21, 3), at(side * reach, level < 11 ? 27.0f : 20.0f, 5), 3.6f, 3.0f});
    if (level < 12) {
      bones.push_back(Rod{at(side * 19, 11, 7), at(side * 31, 19, 3), 3.4f, 3.2f});
      bones.push_back(Rod{at(side * 31, 19, 3), {side * 39, 80 - (z > 60 ? 0.2f * (z - 60) : 0), z - 2}, 3.2f, 3.4f});
    }
  }
  return bones;
}

void add_spine(std::vector<Organ>& organs) {
  std::vector<Shape> bones;
  std::vector<TubePoint> canal, cord;
  for (int level = -1; level < kLevels; ++level) {
    const float z = level_z(level), y = spine_y(z), size = 1 + 0.022f * static_cast<float>(level - 4);
    for (const Shape& bone : vertebra(level)) bones.push_back(bone);
    const float disc_z = z - 0.5f * kLevelPitch;
    organs.push_back({Puck{{0, spine_y(disc_z), disc_z}, {17.5f * size, 13.6f * size, 4.8f}, -0.03f}, kDisc});
    canal.push_back({{0, y + 20.5f * size, z}, 8.0f});
    cord.push_back({{0, y + 20.5f * size, z}, level < 12 ? 4.4f : 3.0f});
  }
  add_bones(organs, bones, 1.5f);
  add_tube(organs, canal, {.shape = {}, .hu = kCanal, .label = PhantomLabel::cord});
  add_tube(organs, cord, {.shape = {}, .hu = kCord, .label = PhantomLabel::cord});
}

std::vector<Shape> sternum() {
  return {RoundedBox{{0, -62, 83}, {23, 4.8f, 19}, rotation({-27, 0, 0}), 4},
          RoundedBox{{0, -81, 18}, {14.5f, 4.4f, 45}, rotation({-10, 0, 0}), 4},
          RoundedBox{{0, -86, -36}, {6, 2.4f, 12}, rotation({-2, 0, 0}), 2}};
}

/// Shapes of the shoulders: blade, spine and joint on both sides, and the collar bones.
std::vector<Shape> shoulder_girdle() {
  std::vector<Shape> bones;
  for (const float side : {-1.0f, 1.0f}) {
    const auto at = [&](float x, float y, float z) { return Point(side * x, y, z); };
    bones.push_back(RoundedBox{at(98, 62, 88), {33, 2.2f, 50}, rotation({-6, side * 7, side * -36}), 2.2f});
    bones.push_back(Rod{at(82, 72, 122), at(132, 44, 140), 3.2f, 5.2f});
    bones.push_back(Rod{at(118, 42, 118), at(128, 28, 128), 5, 9});
    bones.push_back(Ellipsoid{at(146, 14, 137), {20, 20, 22}});
    bones.push_back(Rod{at(146, 14, 137), at(158, 0, 190), 14, 12});
    bones.push_back(Rod{at(20, -60, 104), at(62, -56, 121), 7.0f, 5.2f});
    bones.push_back(Rod{at(62, -56, 121), at(128, -8, 146), 5.2f, 5.5f});
  }
  return bones;
}

}  // namespace

void add_skeleton(std::vector<Organ>& organs) {
  add_spine(organs);
  add_bones(organs, sternum(), 1.2f, 600, 130);
  add_bones(organs, shoulder_girdle(), 1.6f, 1050, 240);
}

}  // namespace tetwarp::phantom
