// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/contours/polygon_interior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

namespace tetwarp {

namespace {

constexpr double kBeside = 1e-6;      // mm from an edge at which its two sides are looked at
constexpr std::size_t kDeepest = 64;  // levels of the tree, each of which halves the edges

/// Squared distance of a point to a box; 0 inside.
double to_box(const glm::dvec2& point, const glm::dvec2& low, const glm::dvec2& high) {
  const glm::dvec2 beyond = glm::max(glm::max(low - point, point - high), glm::dvec2(0));
  return glm::dot(beyond, beyond);
}

double to_edge(const glm::dvec2& point, const glm::dvec2& a, const glm::dvec2& b) {
  const glm::dvec2 along = b - a, from = point - a;
  const double length = glm::dot(along, along);
  const double t = length == 0 ? 0.0 : std::clamp(glm::dot(from, along) / length, 0.0, 1.0);
  const glm::dvec2 apart = from - t * along;
  return glm::dot(apart, apart);
}

}  // namespace

PolygonInterior::PolygonInterior(const std::vector<Ring>& rings) {
  for (const Ring& ring : rings) {
    for (std::size_t n = 0; n < ring.size(); ++n) {
      const glm::dvec2 &a = ring[n], &b = ring[(n + 1) % ring.size()];
      if (a != b) edges_.push_back({a, b});
    }
  }
  if (edges_.empty()) return;
  build(0, edges_.size());
  for (Edge& edge : edges_) {
    const glm::dvec2 along = edge.b - edge.a, middle = (edge.a + edge.b) / 2.0;
    const glm::dvec2 aside = glm::dvec2(-along.y, along.x) * (kBeside / glm::length(along));
    edge.border = contains(middle + aside) != contains(middle - aside);
  }
}

void PolygonInterior::build(std::size_t begin, std::size_t end) {
  const std::size_t at = nodes_.size();
  Node node{glm::dvec2(INFINITY), glm::dvec2(-INFINITY), begin, end};
  for (std::size_t n = begin; n < end; ++n) {
    node.low = glm::min(node.low, glm::min(edges_[n].a, edges_[n].b));
    node.high = glm::max(node.high, glm::max(edges_[n].a, edges_[n].b));
  }
  nodes_.push_back(node);
  if (!node.is_leaf()) {
    const std::size_t middle = begin + (end - begin) / 2;
    build(begin, middle);
    build(middle, end);
  }
  nodes_[at].next = nodes_.size();
}

bool PolygonInterior::contains(const glm::dvec2& point) const {
  bool inside = false;
  for (std::size_t n = 0; n < nodes_.size();) {
    const Node& node = nodes_[n];
    const bool beside = point.y < node.low.y || point.y >= node.high.y || node.high.x <= point.x;
    for (std::size_t e = node.begin; e < node.end && node.is_leaf() && !beside; ++e) {
      const glm::dvec2 &a = edges_[e].a, &b = edges_[e].b;
      if ((a.y > point.y) == (b.y > point.y)) continue;
      if (a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x) > point.x) inside = !inside;
    }
    n = beside ? node.next : n + 1;
  }
  return inside;
}

double PolygonInterior::signed_distance(const glm::dvec2& point) const {
  double nearest = kFar * kFar;  // squared distance
  std::array<std::size_t, kDeepest> waiting;
  std::size_t count = 0;
  if (!nodes_.empty()) waiting[count++] = 0;
  while (count > 0) {
    const std::size_t n = waiting[--count];
    const Node& node = nodes_[n];
    if (to_box(point, node.low, node.high) >= nearest) continue;
    if (node.is_leaf()) {
      for (std::size_t e = node.begin; e < node.end; ++e)
        if (edges_[e].border) nearest = std::min(nearest, to_edge(point, edges_[e].a, edges_[e].b));
      continue;
    }
    std::size_t near = n + 1, far = nodes_[n + 1].next;
    if (to_box(point, nodes_[far].low, nodes_[far].high) < to_box(point, nodes_[near].low, nodes_[near].high))
      std::swap(near, far);
    waiting[count++] = far;
    waiting[count++] = near;
  }
  const double distance = std::sqrt(nearest);
  return contains(point) ? distance : -distance;
}

}  // namespace tetwarp
