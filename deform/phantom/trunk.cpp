// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/phantom/trunk.h"

#include <span>

namespace tetwarp::phantom {

namespace {

struct Section {
  float z;
  Outline body, muscle, cage;
};

// Sections of the trunk from the waist to the neck: height, then half width, front and back of the skin, of the muscles
// and of the cage, mm.
constexpr Section kSections[] = {
    {-180, {158, -120, 108}, {140, -96, 94}, {122, -88, 72}}, {-150, {159, -119, 108}, {140, -96, 94}, {126, -87, 74}},
    {-100, {160, -117, 109}, {141, -96, 95}, {131, -87, 78}}, {-50, {164, -117, 111}, {146, -98, 97}, {132, -88, 80}},
    {0, {169, -115, 112}, {151, -98, 98}, {128, -86, 81}},    {40, {173, -110, 112}, {156, -94, 98}, {118, -78, 80}},
    {75, {176, -102, 111}, {160, -88, 97}, {101, -66, 77}},   {105, {178, -93, 108}, {163, -81, 95}, {77, -51, 70}},
    {125, {179, -85, 104}, {164, -74, 93}, {53, -34, 61}},    {140, {176, -78, 100}, {162, -68, 89}, {29, -16, 49}},
    {150, {170, -73, 97}, {157, -64, 87}, {14, -2, 40}},      {180, {150, -60, 90}, {138, -52, 80}, {6, 4, 34}},
};

/// One of the numbers of an outline: half_width, front or back.
using Member = float Outline::*;

/// A number of a wall at height z: Catmull-Rom between the values at uneven heights, with tangents by central
/// differences.
float smooth(float z, Outline Section::*wall, Member member) {
  const std::span<const Section> rows(kSections);
  std::size_t right = 1;
  while (right + 1 < rows.size() && rows[right].z < z) ++right;
  const std::size_t left = right - 1, before = left ? left - 1 : left, after = std::min(right + 1, rows.size() - 1);
  const auto value = [&](std::size_t row) { return rows[row].*wall.*member; };
  const auto slope = [&](std::size_t from, std::size_t to) {
    return (value(to) - value(from)) / (rows[to].z - rows[from].z);
  };
  const float width = rows[right].z - rows[left].z, t = (z - rows[left].z) / width, s = 1 - t;
  return s * s * (1 + 2 * t) * value(left) + t * t * (1 + 2 * s) * value(right) +
         s * t * width * (s * slope(before, right) - t * slope(left, after));
}

Outline outline_at(float z, Outline Section::*wall) {
  const Outline here{smooth(z, wall, &Outline::half_width), smooth(z, wall, &Outline::front),
                     smooth(z, wall, &Outline::back)};
  const float slope = 0.5f * (smooth(z + 1, wall, &Outline::half_width) - smooth(z - 1, wall, &Outline::half_width));
  return {here.half_width, here.front, here.back, 1 / std::sqrt(1 + slope * slope)};
}

Outline mix(const Outline& a, const Outline& b, float t) {
  return {a.half_width + t * (b.half_width - a.half_width), a.front + t * (b.front - a.front),
          a.back + t * (b.back - a.back), a.tilt + t * (b.tilt - a.tilt)};
}

/// Approximate distance to an outline: (f - 1) / |grad f| for the squircle f = u^2 + v^2 - s u^2 v^2. Far outside,
/// where f would fall again, its last term no longer grows.
float distance(const Outline& o, Point p) {
  constexpr float kSquareness = 0.33f;
  const float a = o.half_width, b = 0.5f * (o.back - o.front);
  const float u = p.x / a, v = (p.y - 0.5f * (o.front + o.back)) / b, uu = u * u, vv = v * v;
  const float near_uu = std::min(uu, 1.0f), near_vv = std::min(vv, 1.0f);
  const float du = u * (1 - kSquareness * near_vv) / a, dv = v * (1 - kSquareness * near_uu) / b;
  const float f = uu + vv - kSquareness * near_uu * near_vv;
  return o.tilt * 0.5f * (f - 1) / (std::sqrt(du * du + dv * dv) + 1e-4f);
}

/// Half width of the mediastinum at depth y: narrow in front, wide at the hila, and the spine behind.
float mediastinum(float y) {
  struct Step {
    float y, half_width;
  };
  constexpr Step kSteps[] = {{-100, 7}, {-65, 8}, {-40, 19}, {-10, 29}, {20, 29}, {45, 21}, {70, 19}, {100, 19}};
  if (y <= kSteps[0].y) return kSteps[0].half_width;
  for (std::size_t i = 1; i < std::size(kSteps); ++i) {
    const Step &a = kSteps[i - 1], &b = kSteps[i];
    if (y > b.y) continue;
    const float t = (y - a.y) / (b.y - a.y);
    return a.half_width + t * t * (3 - 2 * t) * (b.half_width - a.half_width);
  }
  return kSteps[std::size(kSteps) - 1].half_width;
}

}  // namespace

Trunk::Trunk() : heart_(heart()) {
  for (int i = 0; i < kHeights; ++i) {
    const float z = static_cast<float>(i - kHeights / 2);
    layers_[static_cast<std::size_t>(i)] = {outline_at(z, &Section::body), outline_at(z, &Section::muscle),
                                            outline_at(z, &Section::cage)};
  }
}

Trunk::Layers Trunk::layers(float z) const {
  const float position = std::clamp(z + static_cast<float>(kHeights / 2), 0.0f, static_cast<float>(kHeights - 2));
  const auto below = static_cast<std::size_t>(position);
  const float t = position - static_cast<float>(below);
  const Layers &a = layers_[below], &b = layers_[below + 1];
  return {mix(a.body, b.body, t), mix(a.muscle, b.muscle, t), mix(a.cage, b.cage, t)};
}

Walls Trunk::walls(Point p) const {
  const Layers at = layers(p.z);
  const float apex = p.z - 143;  // here the cage ends in a round top
  return {distance(at.body, p), distance(at.muscle, p), std::max(distance(at.cage, p), apex), diaphragm(p)};
}

float Trunk::lungs(Point p, const Walls& walls) const {
  const float outside = std::max(walls.cage, 2 - walls.diaphragm);
  if (outside > 5) return outside;
  const float wider_above = std::clamp((p.z - 90) * 0.15f, 0.0f, 6.0f);
  const float beside = mediastinum(p.y) + wider_above - std::abs(p.x - 2);
  return std::max({outside, beside, -heart_.distance(p)});
}

Trunk::Rib Trunk::rib(Point p, const Walls& walls) const {
  constexpr float kThickness = 3.4f, kHeight = 6.3f, kFall = 0.42f;  // half sizes in mm, and how steeply ribs fall
  constexpr float kFrontEnds[12] = {-200, -200, -200, -200, -200, -200, -200, -84, -76, -62, -15, 30};
  const float at_spine = p.z + kFall * (70 - p.y), steps = (level_z(0) - at_spine) / kLevelPitch;
  const int level = static_cast<int>(std::clamp(steps + 0.5f, 0.0f, 11.0f));
  const float cosine = 0.92f, h = (at_spine - level_z(level)) * cosine / kHeight, s = (walls.cage - 4.2f) / kThickness;
  const float band = (std::sqrt(h * h + s * s) - 1) * kThickness;
  const float behind_end = kFrontEnds[level] - p.y;
  const float beside_spine = p.y > 0 ? 36 - std::abs(p.x) : -1;
  const float beside_sternum = p.y < 0 ? 15 - std::abs(p.x) : -1;
  const float cartilage_from = -48 - 1.2f * static_cast<float>(level);
  return {std::max({band, behind_end, beside_spine, beside_sternum}), p.y < cartilage_from};
}

float diaphragm(Point p) {
  struct Dome {
    // Middle, height, and how far the dome falls per mm^2 sideways, forwards and backwards.
    float x, y, top, across, front, back;
  };
  constexpr Dome kDomes[] = {{-66, -10, -34, 0.011f, 0.0075f, 0.0115f},
                             {68, -8, -46, 0.011f, 0.0075f, 0.0105f},
                             {4, -32, -60, 0.006f, 0.006f, 0.012f}};
  float height = -1e9f, slope = 0;
  for (const Dome& dome : kDomes) {
    const float dx = p.x - dome.x, dy = p.y - dome.y, along = dy < 0 ? dome.front : dome.back;
    const float here = dome.top - dome.across * dx * dx - along * dy * dy;
    if (here <= height) continue;
    height = here;
    slope = 4 * (dome.across * dome.across * dx * dx + along * along * dy * dy);
  }
  return (p.z - height) / std::sqrt(1 + slope);
}

Ellipsoid heart() { return {{20, -36, -12}, {66, 46, 47}, rotation({0, 24, -34})}; }

float spine_y(float z) {
  const float t = (z - 30) / 150;
  return 52 - 16 * t * t;
}

}  // namespace tetwarp::phantom
