// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <numeric>

#include "deform/phantom/anatomy.h"
#include "deform/phantom/random.h"

namespace tetwarp::phantom {

namespace {

struct Node {
  Point point;
  std::size_t parent;
  float path;    ///< mm along the tree from the root
  int ends = 0;  ///< number of ends that are fed through this node
};

/// The node to which an end is joined: near, but without a long detour from the root.
std::size_t best_parent(const std::vector<Node>& nodes, Point end) {
  std::size_t best = 0;
  float least = 1e9f;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const float cost = glm::distance(nodes[i].point, end) + 0.3f * nodes[i].path;
    if (cost < least) least = cost, best = i;
  }
  return best;
}

std::vector<Point> spread_ends(const VesselTree& tree, bool (*inside)(const Trunk&, Point), const Trunk& trunk,
                               Random& random) {
  std::vector<Point> ends;
  for (int tries = 0; tries < 200 * tree.count && std::ssize(ends) < tree.count; ++tries) {
    Point p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = random.between(tree.box.low[axis], tree.box.high[axis]);
    if (inside(trunk, p)) ends.push_back(p);
  }
  std::stable_sort(ends.begin(), ends.end(),
                   [&](Point a, Point b) { return glm::distance(a, tree.root) < glm::distance(b, tree.root); });
  return ends;
}

}  // namespace

void add_tube(std::vector<Organ>& organs, const std::vector<TubePoint>& points, const Organ& like) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    Organ piece = like;
    piece.shape = Rod{points[i - 1].point, points[i].point, points[i - 1].radius, points[i].radius};
    organs.push_back(piece);
  }
}

void add_vessels(std::vector<Organ>& organs, const VesselTree& tree, bool (*inside)(const Trunk&, Point),
                 const Trunk& trunk, std::uint64_t seed) {
  Random random(seed);
  std::vector<Node> nodes = {{tree.root, 0, 0}};
  for (const Point end : spread_ends(tree, inside, trunk, random)) {
    std::size_t from = best_parent(nodes, end);
    const Point start = nodes[from].point;
    const float length = glm::distance(start, end);
    constexpr int kPieces = 3;  // a branch has three pieces and is bent a little; later branches may begin on it
    for (int piece = 1; piece <= kPieces; ++piece) {
      Point p = glm::mix(start, end, static_cast<float>(piece) / kPieces);
      if (piece < kPieces) p += 0.09f * length * Point{random.uniform(), random.uniform(), random.uniform()};
      nodes.push_back({p, from, nodes[from].path + glm::distance(nodes[from].point, p)});
      from = nodes.size() - 1;
    }
    for (std::size_t node = from; node != 0; node = nodes[node].parent) ++nodes[node].ends;
  }
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const Node& node = nodes[i];
    const float radius = tree.end_radius * std::sqrt(static_cast<float>(node.ends));
    organs.push_back({Rod{nodes[node.parent].point, node.point, radius, radius}, tree.hu, tree.within});
  }
}

}  // namespace tetwarp::phantom
