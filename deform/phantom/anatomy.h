// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/phantom.h"
#include "deform/phantom/trunk.h"

namespace tetwarp::phantom {

/// The part of the body to which an organ is clipped.
enum class Within : std::uint8_t {
  everything,
  chest,    ///< above the diaphragm
  abdomen,  ///< below the diaphragm, inside the cage
};

constexpr float kNoLevel = 1000;

/// A shape with one HU. An organ that is painted later covers an earlier one.
struct Organ {
  Shape shape;
  float hu = 0;
  Within within = Within::everything;
  float grow = 0;  ///< mm by which the shape is grown; marrow is its bone, shrunk
  /// y of a level: only what lies in front of it is painted, as gas above fluid in a patient who lies on the back.
  float level_y = kNoLevel;
  PhantomLabel label = PhantomLabel::body;
};

/// Gives labels to organs group by group, as they are added.
class GroupLabels {
 public:
  /// The first group begins with what is added from now on.
  explicit GroupLabels(std::vector<Organ>& organs) : organs_(organs), first_(organs.size()) {}
  /// Ends a group: the organs of it are of this label. The next group begins.
  void are(PhantomLabel label) {
    for (; first_ < organs_.size(); ++first_) organs_[first_].label = label;
  }
  /// Ends a group whose organs keep the labels that they have.
  void keep() { first_ = organs_.size(); }

 private:
  std::vector<Organ>& organs_;
  std::size_t first_;
};

/// All organs inside the trunk's walls, in the order in which they are painted.
std::vector<Organ> make_organs(const Trunk& trunk, std::uint64_t seed);

void add_skeleton(std::vector<Organ>& organs);
void add_chest(std::vector<Organ>& organs, const Trunk& trunk, std::uint64_t seed);
void add_abdomen(std::vector<Organ>& organs, const Trunk& trunk, std::uint64_t seed);

/// A place on the middle line of a tube, and the tube's radius there, mm.
struct TubePoint {
  Point point;
  float radius;
};
void add_tube(std::vector<Organ>& organs, const std::vector<TubePoint>& points, const Organ& like);

/// A tree of vessels from `root` to `count` ends that are spread over the box, where `inside` holds. Radii follow
/// Leonardo's rule: a branch has the area of its children together.
struct VesselTree {
  Point root;
  Bounds box;
  int count;
  float end_radius;
  float hu;
  Within within = Within::everything;
};
void add_vessels(std::vector<Organ>& organs, const VesselTree& tree, bool (*inside)(const Trunk&, Point),
                 const Trunk& trunk, std::uint64_t seed);

}  // namespace tetwarp::phantom
