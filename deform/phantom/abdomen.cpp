// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/phantom/anatomy.h"
#include "deform/phantom/random.h"

namespace tetwarp::phantom {

namespace {

constexpr float kLiver = 65, kSpleen = 62, kMuscle = 55, kWall = 42, kFluid = 12, kGas = -960, kFat = -95;
constexpr float kNoGas = -1000;  // a level in front of everything, so no gas

const Ellipsoid kRightLobe{{-68, -4, -84}, {72, 84, 78}};

bool in_right_lobe(const Trunk& trunk, Point p) {
  const Walls walls = trunk.walls(p);
  return kRightLobe.distance(p) < -8 && walls.diaphragm < -10 && walls.cage < -8;
}

void add_liver(std::vector<Organ>& organs, const Trunk& trunk, std::uint64_t seed) {
  organs.push_back({kRightLobe, kLiver, Within::abdomen});
  organs.push_back({Ellipsoid{{-4, -48, -82}, {66, 34, 30}, rotation({0, 10, 6})}, kLiver, Within::abdomen});
  const VesselTree portal{.root = {-34, -2, -100},
                          .box = {{-135, -85, -150}, {-15, 75, -35}},
                          .count = 60,
                          .end_radius = 0.75f,
                          .hu = kLiver + 38,
                          .within = Within::abdomen};
  VesselTree hepatic = portal;
  hepatic.root = {-22, 6, -54};
  hepatic.count = 45;
  add_vessels(organs, portal, in_right_lobe, trunk, seed + 11);
  add_vessels(organs, hepatic, in_right_lobe, trunk, seed + 12);
  organs.push_back({Rod{{-36, -62, -96}, {-34, -2, -102}, 2.5f, 4}, kFat, Within::abdomen});  // fissure to the hilum
  organs.push_back(
      {Ellipsoid{{-50, -58, -128}, {14, 15, 27}, rotation({20, 0, 0})}, 8, Within::abdomen});  // gallbladder
}

void add_kidney(std::vector<Organ>& organs, float side) {
  const Point centre(side * 62, 40, side < 0 ? -124 : -112);
  const glm::mat3 axes = rotation({8, side * 8, side * 32});
  const auto part = [&](Point offset, Point semi_axes) {
    return Ellipsoid{centre + axes * (offset * Point(side, 1, 1)), semi_axes, axes};
  };
  organs.push_back({part({0, 0, 0}, {33, 29, 58}), kFat - 8, Within::abdomen});
  GroupLabels kidney(organs);
  organs.push_back({part({0, 0, 0}, {26, 22, 50}), 125, Within::abdomen});
  for (const float z : {-30.0f, -15.0f, 0.0f, 15.0f, 30.0f}) {  // pyramids
    const float inner = 1 - z * z / 2500;
    organs.push_back({part({-3, 9 * inner, z}, {12 * inner, 6.5f, 5}), 75, Within::abdomen});
    organs.push_back({part({-3, -9 * inner, z}, {12 * inner, 6.5f, 5}), 75, Within::abdomen});
  }
  organs.push_back({part({-17, 0, 0}, {17, 9, 24}), kFat + 10, Within::abdomen});  // sinus
  organs.push_back(
      {Rod{centre + axes * Point(-side * 16, 0, 0), {side * 12, 20, centre.z + 4}, 4, 4.5f}, 120, Within::abdomen});
  kidney.are(PhantomLabel::kidney);
}

/// Adds a hollow organ: its wall, its fluid, and gas in front of the level.
void add_hollow(std::vector<Organ>& organs, const Shape& shape, float wall_mm, float fluid_hu, float level_y) {
  organs.push_back({shape, kWall, Within::abdomen});
  organs.push_back({shape, fluid_hu, Within::abdomen, -wall_mm});
  organs.push_back({shape, kGas, Within::abdomen, -wall_mm, level_y});
}

void add_bowel(std::vector<Organ>& organs, Random& random) {
  for (int loop = 0; loop < 26; ++loop) {  // small bowel
    const Point a{random.between(-55, 75), random.between(-72, -8), random.between(-190, -128)};
    const Point b = a + Point{random.between(-26, 26), random.between(-14, 14), random.between(-12, 12)};
    const float radius = random.between(8, 11.5f);
    organs.push_back({Rod{a, b, radius, radius}, kWall + random.between(0, 25), Within::abdomen});
    organs.push_back({Rod{a, b, radius, radius}, random.between(5, 45), Within::abdomen, -2});
  }
  const auto colon = [&](Point a, Point b, float level_y) {
    const Rod tube{a, b, random.between(16, 19), random.between(16, 20)};
    add_hollow(organs, tube, 2.5f, random.between(-20, 50), level_y);
  };
  colon({-100, -4, -190}, {-102, -14, -146}, -22);
  colon({-102, -14, -146}, {-72, -58, -140}, -52);
  colon({-72, -58, -140}, {-22, -74, -150}, -74);
  colon({-22, -74, -150}, {36, -74, -140}, -78);
  colon({36, -74, -140}, {88, -50, -116}, -62);
  colon({88, -50, -116}, {108, -2, -96}, -26);
  colon({108, -2, -96}, {110, 16, -190}, kNoGas);
}

}  // namespace

void add_abdomen(std::vector<Organ>& organs, const Trunk& trunk, std::uint64_t seed) {
  Random random(seed + 13);
  GroupLabels groups(organs);
  for (const float side : {-1.0f, 1.0f}) {
    organs.push_back({Rod{{side * 27, 46, -92}, {side * 44, 34, -190}, 7, 21}, kMuscle, Within::abdomen});    // psoas
    organs.push_back({Rod{{side * 10, 30, -85}, {side * 13, 30, -150}, 5.5f, 4}, kMuscle, Within::abdomen});  // crus
  }
  groups.are(PhantomLabel::body);
  add_bowel(organs, random);
  groups.are(PhantomLabel::bowel);
  add_kidney(organs, -1);
  add_kidney(organs, 1);
  groups.keep();
  add_tube(organs, {{{-14, 22, -190}, 11}, {{-18, 18, -110}, 11.5f}, {{-21, 6, -58}, 12}, {{-22, -4, -30}, 12}},
           {.shape = {}, .hu = 95});
  groups.are(PhantomLabel::vessel);
  organs.push_back({Ellipsoid{{96, 38, -84}, {26, 44, 46}, rotation({10, 12, 24})}, kSpleen, Within::abdomen});
  groups.are(PhantomLabel::spleen);
  add_hollow(organs, Ellipsoid{{60, -22, -84}, {44, 42, 36}, rotation({0, 22, -24})}, 3.5f, kFluid, -34);
  groups.are(PhantomLabel::stomach);
  add_tube(organs, {{{-30, -12, -124}, 13}, {{-6, -22, -116}, 9}, {{24, -16, -108}, 9}, {{62, 12, -98}, 8}},
           {.shape = {}, .hu = 48, .within = Within::abdomen});
  groups.are(PhantomLabel::body);
  add_tube(organs, {{{2, -8, -120}, 6}, {{-16, -8, -110}, 7}, {{-34, -2, -100}, 7}},
           {.shape = {}, .hu = 105, .within = Within::abdomen});
  groups.are(PhantomLabel::vessel);
  add_liver(organs, trunk, seed);
  groups.are(PhantomLabel::liver);
}

std::vector<Organ> make_organs(const Trunk& trunk, std::uint64_t seed) {
  std::vector<Organ> organs;
  add_chest(organs, trunk, seed);
  add_abdomen(organs, trunk, seed);
  add_skeleton(organs);
  return organs;
}

}  // namespace tetwarp::phantom
