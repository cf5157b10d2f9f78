// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/phantom/trunk.h"

namespace tetwarp::phantom {

/// What an organ is cut by.
enum class Within : std::uint8_t {
  everything,
  chest,    ///< above the diaphragm
  abdomen,  ///< below the diaphragm, inside the cage
};

constexpr float kNoLevel = 1000;

/// A shape of one HU. A later organ covers an earlier one.
struct Organ {
  Shape shape;
  float hu = 0;
  Within within = Within::everything;
  float grow = 0;            ///< mm that the shape is grown by: the marrow is the bone, shrunk
  float level_y = kNoLevel;  ///< only what lies in front of this: gas above fluid in somebody who lies on the back
};

/// Everything inside the trunk's walls, in the order of painting.
std::vector<Organ> make_organs(const Trunk& trunk, std::uint64_t seed);

void add_skeleton(std::vector<Organ>& organs);
void add_chest(std::vector<Organ>& organs, const Trunk& trunk, std::uint64_t seed);
void add_abdomen(std::vector<Organ>& organs, const Trunk& trunk, std::uint64_t seed);

/// A tube along points, of one radius each.
struct TubePoint {
  Point point;
  float radius;
};
void add_tube(std::vector<Organ>& organs, const std::vector<TubePoint>& points, const Organ& like);

/// A tree of vessels from `root` to `count` ends spread over the box where `inside` holds; radii follow Leonardo's
/// rule (a branch has the area of its children).
struct VesselTree {
  Point root;
  Box box;
  int count;
  float end_radius;
  float hu;
  Within within = Within::everything;
};
void add_vessels(std::vector<Organ>& organs, const VesselTree& tree, bool (*inside)(const Trunk&, Point),
                 const Trunk& trunk, std::uint64_t seed);

}  // namespace tetwarp::phantom
