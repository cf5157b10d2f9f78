// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/phantom/anatomy.h"

namespace tetwarp::phantom {

namespace {

constexpr float kAir = -990, kFat = -95, kMuscle = 55, kWall = 40, kMyocardium = 85, kBlood = 145, kVein = 110;

bool in_right_lung(const Trunk& trunk, Point p) { return p.x < 0 && trunk.lungs(p, trunk.walls(p)) < -3; }
bool in_left_lung(const Trunk& trunk, Point p) { return p.x > 0 && trunk.lungs(p, trunk.walls(p)) < -3; }

/// Adds the fat around the heart, its muscle, and its four chambers.
void add_heart(std::vector<Organ>& organs) {
  const Ellipsoid fat = heart();
  const auto part = [&](Point offset, Point semi_axes) {  // along the heart's own axes: apex, left and back, up
    return Ellipsoid{fat.centre + fat.axes * offset, semi_axes, fat.axes};
  };
  const auto add = [&](const Shape& shape, float hu, float grow = 0) {
    organs.push_back({shape, hu, Within::chest, grow});
  };
  add(fat, -70, -1);
  add(part({-1, 0, 0}, {61, 41, 42}), kMyocardium);
  add(part({14, 13, 0}, {38, 17, 19}), kBlood);        // left ventricle
  add(part({10, -21, -4}, {42, 13, 28}), kVein + 10);  // right ventricle
  add(part({-38, 18, 12}, {20, 19, 20}), kBlood);      // left atrium
  add(part({-38, -16, -2}, {20, 18, 27}), kVein + 5);  // right atrium
}

void add_great_vessels(std::vector<Organ>& organs) {
  const Organ artery{.shape = {}, .hu = kBlood}, vein{.shape = {}, .hu = kVein}, lung_artery{.shape = {}, .hu = 130};
  add_tube(organs,
           {{{-24, -14, 20}, 11},
            {{-25, -16, 60}, 9.5f},
            {{-23, -20, 92}, 8.5f},
            {{-34, -34, 116}, 7},
            {{-50, -30, 150}, 6.5f}},
           vein);
  add_tube(organs, {{{-23, -20, 94}, 7}, {{8, -40, 104}, 7}, {{36, -38, 118}, 6.5f}, {{50, -26, 150}, 6.5f}}, vein);
  add_tube(organs,
           {{{18, -52, 12}, 14}, {{19, -42, 34}, 14}, {{20, -22, 50}, 13}, {{32, -4, 54}, 11}, {{44, 8, 50}, 9}},
           lung_artery);
  add_tube(organs, {{{20, -24, 48}, 12}, {{-4, -6, 46}, 11}, {{-30, 2, 42}, 10}, {{-43, 6, 36}, 8.5f}}, lung_artery);
  add_tube(organs,
           {{{2, -34, 10}, 15},
            {{-7, -40, 34}, 16},
            {{-8, -36, 60}, 15.5f},
            {{-1, -24, 78}, 14.5f},
            {{10, -8, 86}, 14},
            {{20, 10, 83}, 13},
            {{25, 24, 70}, 12.5f},
            {{25, 32, 45}, 12},
            {{22, 33, 0}, 11.5f},
            {{17, 30, -50}, 11},
            {{9, 22, -95}, 10},
            {{5, 10, -150}, 9.5f},
            {{4, 4, -185}, 9.5f}},
           artery);
  add_tube(organs, {{{-4, -20, 88}, 6}, {{-16, -18, 112}, 5.5f}, {{-22, -10, 185}, 4}}, artery);
  add_tube(organs, {{{8, -10, 94}, 4}, {{14, -8, 118}, 3.8f}, {{22, -6, 185}, 3.8f}}, artery);
  add_tube(organs, {{{18, 4, 92}, 5}, {{27, 4, 118}, 4.8f}, {{48, -8, 134}, 4.5f}, {{100, -24, 138}, 4}}, artery);
  add_tube(organs, {{{-17, -16, 114}, 5}, {{-46, -10, 134}, 4.5f}, {{-100, -24, 138}, 4}}, artery);
}

/// Adds the walls of the airways, then the air in them.
void add_airways(std::vector<Organ>& organs) {
  const std::vector<std::vector<TubePoint>> airways = {
      {{{0, -2, 185}, 8.5f}, {{0, 4, 130}, 8.8f}, {{-3, 14, 62}, 8.5f}},
      {{{-3, 14, 62}, 7.2f}, {{-28, 18, 42}, 6.5f}, {{-44, 20, 28}, 5}, {{-54, 24, 5}, 3.6f}, {{-62, 34, -16}, 2.5f}},
      {{{-30, 18, 42}, 4.8f}, {{-48, 14, 52}, 3.6f}, {{-62, 8, 70}, 2.4f}},
      {{{-46, 20, 24}, 3.4f}, {{-62, -8, 8}, 2.4f}, {{-72, -28, -2}, 1.8f}},
      {{{-3, 14, 62}, 6.8f}, {{22, 18, 42}, 6}, {{44, 22, 30}, 4.8f}, {{54, 30, 8}, 3.4f}, {{62, 42, -14}, 2.4f}},
      {{{40, 20, 32}, 4.4f}, {{54, 8, 44}, 3.2f}, {{64, -4, 62}, 2.2f}}};
  for (const auto& airway : airways) add_tube(organs, airway, {.shape = {}, .hu = kWall, .grow = 1.5f});
  for (const auto& airway : airways) add_tube(organs, airway, {.shape = {}, .hu = kAir});
}

/// Adds the muscles outside the cage, and the fat between them.
void add_chest_wall(std::vector<Organ>& organs) {
  for (const float side : {-1.0f, 1.0f}) {
    const auto at = [&](float x, float y, float z) { return Point(side * x, y, z); };
    organs.push_back({Ellipsoid{at(116, -2, 98), {13, 44, 54}, rotation({0, side * 14, side * -12})}, kFat});  // armpit
    organs.push_back({Ellipsoid{at(112, 62, 70), {7, 30, 62}, rotation({0, side * 6, side * 50})}, kFat + 15});
    organs.push_back({Ellipsoid{at(80, -73, 64), {52, 5.0f, 44}, rotation({-14, 0, side * 16})}, kFat + 10});
    organs.push_back({Ellipsoid{at(76, -77, 68), {56, 6.5f, 46}, rotation({-14, 0, side * 16})}, kMuscle});  // pectoral
    const Ellipsoid back{at(33, 87, -70), {27, 13, 230}, rotation({3, 0, side * -9})};
    organs.push_back({back, kFat + 40, Within::everything, 1.1f});
    organs.push_back({back, kMuscle});
  }
}

}  // namespace

void add_chest(std::vector<Organ>& organs, const Trunk& trunk, std::uint64_t seed) {
  GroupLabels groups(organs);
  add_chest_wall(organs);
  groups.are(PhantomLabel::body);
  const VesselTree right{
      .root = {-42, 8, 34}, .box = {{-135, -90, -120}, {-20, 85, 142}}, .count = 900, .end_radius = 0.4f, .hu = 45};
  VesselTree left = right;
  left.root = {44, 10, 42};
  left.box = {{15, -90, -120}, {135, 85, 142}};
  add_vessels(organs, right, in_right_lung, trunk, seed + 1);
  add_vessels(organs, left, in_left_lung, trunk, seed + 2);
  groups.are(PhantomLabel::lung);
  add_heart(organs);
  groups.are(PhantomLabel::heart);
  add_great_vessels(organs);
  groups.are(PhantomLabel::vessel);
  add_tube(organs, {{{5, 22, 185}, 7}, {{5, 28, 60}, 7}, {{8, 22, 0}, 7}, {{22, 8, -58}, 8}},
           {.shape = {}, .hu = kWall});
  add_tube(organs, {{{5, 21, 185}, 1.5f}, {{5, 27, 60}, 2}, {{8, 21, 0}, 1.5f}}, {.shape = {}, .hu = -600});
  groups.are(PhantomLabel::oesophagus);
  add_airways(organs);
  groups.are(PhantomLabel::airway);
  for (const float side : {-1.0f, 1.0f}) {
    organs.push_back({Ellipsoid{{side * 17, -4, 152}, {8, 9, 22}}, 120});  // thyroid
  }
}

}  // namespace tetwarp::phantom
