// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <vector>

#include "deform/contours/polygon.h"

namespace tetwarp {

/// The area inside an odd number of closed polygons of a plane, and how far a place is from its border.
///
/// Edges with the area on both sides are no border: the channel of a keyhole, and what two equal rings take away from
/// each other. The edges lie in a tree of boxes over runs of neighbouring edges, for polygons are coherent already.
class PolygonInterior {
 public:
  /// @param rings  mm, of three corners or more; they may touch and cross
  explicit PolygonInterior(const std::vector<Ring>& rings);

  static constexpr double kFar = 1e9;  ///< mm

  bool contains(const glm::dvec2& point) const;
  /// Exact signed distance from the border, mm, positive inside; -kFar where there is no border.
  double signed_distance(const glm::dvec2& point) const;

 private:
  struct Edge {
    glm::dvec2 a, b;
    bool border = true;
  };
  static constexpr std::size_t kLeaf = 4;
  struct Node {
    glm::dvec2 low, high;
    std::size_t begin = 0, end = 0;  ///< edges below this node
    /// The node after all those below this one. Its first child is the node right after it.
    std::size_t next = 0;

    bool is_leaf() const { return end - begin <= kLeaf; }
  };

  void build(std::size_t begin, std::size_t end);

  std::vector<Edge> edges_;
  std::vector<Node> nodes_;
};

}  // namespace tetwarp
