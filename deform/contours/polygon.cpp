// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/contours/polygon.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "deform/contours/edge_distance.h"

namespace tetwarp {

namespace {

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// Where the horizontal line through `point` crosses the edge from a to b, if it does. Of the ends of an edge only one
/// counts, as in `contains`.
bool crosses(const glm::dvec2& point, const glm::dvec2& a, const glm::dvec2& b, double& x) {
  if ((a.y > point.y) == (b.y > point.y)) return false;
  x = a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x);
  return true;
}

/// Marks the corners between `first` and `last` (counted round the ring) that simplification must keep.
void keep_far_corners(const Ring& ring, std::size_t first, std::size_t last, double tolerance,
                      std::vector<bool>& kept) {
  std::vector<std::pair<std::size_t, std::size_t>> open{{first, last}};
  while (!open.empty()) {
    const auto [from, to] = open.back();
    open.pop_back();
    double farthest = tolerance;
    std::size_t corner = to;
    for (std::size_t n = from + 1; n < to; ++n) {
      const double distance = distance_to_edge(ring[n], ring[from], ring[to % ring.size()]);
      if (distance > farthest) {
        farthest = distance;
        corner = n;
      }
    }
    if (corner == to) continue;
    kept[corner] = true;
    open.emplace_back(from, corner);
    open.emplace_back(corner, to);
  }
}

std::size_t rightmost(const Ring& ring) {
  const auto by_x = [](const glm::dvec2& a, const glm::dvec2& b) { return a.x < b.x; };
  return static_cast<std::size_t>(std::max_element(ring.begin(), ring.end(), by_x) - ring.begin());
}

/// Joins a hole to the ring around it, along the horizontal line from the hole's rightmost corner to the right. Holes
/// further to the right have been joined before, so nothing lies on that line before the ring.
void join(Ring& border, const Ring& hole) {
  const std::size_t start = rightmost(hole);
  const glm::dvec2 from = hole[start];
  double nearest = INFINITY;
  std::size_t edge = border.size();
  for (std::size_t n = 0; n < border.size(); ++n) {
    double x = 0;
    if (!crosses(from, border[n], border[(n + 1) % border.size()], x) || x < from.x || x >= nearest) continue;
    nearest = x;
    edge = n;
  }
  if (edge == border.size()) return;
  Ring way{{nearest, from.y}};
  for (std::size_t n = 0; n <= hole.size(); ++n) way.push_back(hole[(start + n) % hole.size()]);
  way.push_back(way.front());
  border.insert(border.begin() + static_cast<std::ptrdiff_t>(edge) + 1, way.begin(), way.end());
}

}  // namespace

double signed_area(std::span<const glm::dvec2> ring) {
  double twice = 0;
  for (std::size_t n = 0; n < ring.size(); ++n)
    twice += cross(ring[n] - ring[0], ring[(n + 1) % ring.size()] - ring[0]);
  return twice / 2;
}

bool contains(std::span<const glm::dvec2> ring, const glm::dvec2& point) {
  bool inside = false;
  for (std::size_t n = 0; n < ring.size(); ++n) {
    double x = 0;
    if (crosses(point, ring[n], ring[(n + 1) % ring.size()], x) && x > point.x) inside = !inside;
  }
  return inside;
}

double nested_area(const std::vector<Ring>& rings) {
  double area = 0;
  for (auto at = rings.begin(); at != rings.end(); ++at) {
    const Ring& ring = *at;
    // Equal rings cancel each other in pairs: of an odd number the first counts.
    const bool counted = std::find(rings.begin(), at, ring) == at && std::count(at, rings.end(), ring) % 2 == 1;
    if (ring.empty() || !counted) continue;
    const auto around = std::count_if(
        rings.begin(), rings.end(), [&](const Ring& other) { return other != ring && contains(other, ring.front()); });
    area += (around % 2 == 0 ? 1 : -1) * std::abs(signed_area(ring));
  }
  return area;
}

Ring simplified(const Ring& ring, double tolerance) {
  if (ring.size() < 4) return ring;
  std::size_t opposite = 0;
  for (std::size_t n = 1; n < ring.size(); ++n)
    if (glm::distance(ring[n], ring[0]) > glm::distance(ring[opposite], ring[0])) opposite = n;
  if (opposite == 0) return {ring.front()};
  std::vector<bool> kept(ring.size());
  kept[0] = kept[opposite] = true;
  keep_far_corners(ring, 0, opposite, tolerance, kept);
  keep_far_corners(ring, opposite, ring.size(), tolerance, kept);
  Ring result;
  for (std::size_t n = 0; n < ring.size(); ++n)
    if (kept[n]) result.push_back(ring[n]);
  return result;
}

std::vector<Ring> joined_by_keyholes(std::vector<Ring> rings) {
  const auto first_hole =
      std::stable_partition(rings.begin(), rings.end(), [](const Ring& ring) { return signed_area(ring) > 0; });
  std::vector<Ring> holes(std::make_move_iterator(first_hole), std::make_move_iterator(rings.end()));
  rings.erase(first_hole, rings.end());
  const std::vector<Ring> borders = rings;
  std::stable_sort(holes.begin(), holes.end(),
                   [](const Ring& a, const Ring& b) { return a[rightmost(a)].x > b[rightmost(b)].x; });
  for (const Ring& hole : holes) {
    std::size_t around = borders.size();
    for (std::size_t n = 0; n < borders.size(); ++n) {
      if (!contains(borders[n], hole.front())) continue;
      if (around == borders.size() || signed_area(borders[n]) < signed_area(borders[around])) around = n;
    }
    if (around != borders.size()) join(rings[around], hole);
  }
  return rings;
}

}  // namespace tetwarp
