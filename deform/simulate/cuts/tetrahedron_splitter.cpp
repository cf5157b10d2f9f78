// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/cuts/tetrahedron_splitter.h"

#include <algorithm>
#include <cmath>

#include "deform/core/five_tetrahedra.h"

namespace tetwarp::simulate {

namespace {

using Triangle = TetrahedronSplitter::Triangle;

Triangle sorted(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  Triangle t{a, b, c};
  std::sort(t.begin(), t.end());
  return t;
}

constexpr int kFaces[4][3] = {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}};
constexpr int kEdges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

/// Adds the two triangles of a quadrilateral. The diagonal begins at the lowest vertex, so that both sides choose the
/// same.
void add_quadrilateral(const std::array<std::uint32_t, 4>& round, std::vector<Triangle>& triangles) {
  const auto lowest = static_cast<std::size_t>(std::min_element(round.begin(), round.end()) - round.begin());
  const auto at = [&](std::size_t n) { return round[(lowest + n) % 4]; };
  triangles.push_back(sorted(at(0), at(1), at(2)));
  triangles.push_back(sorted(at(0), at(2), at(3)));
}

}  // namespace

double TetrahedronSplitter::Vertex::mean(const std::function<double(std::uint32_t)>& of_corner) const {
  double sum = 0;
  for (std::size_t n = 0; n < 4 && corner[n] != kNone; ++n) sum += weight[n] * of_corner(corner[n]);
  return sum;
}

TetrahedronSplitter::TetrahedronSplitter(const glm::i64vec3& lattice, std::span<const std::uint64_t> cells) {
  std::unordered_map<std::uint32_t, std::uint32_t> number_of;
  const auto vertex_at = [&](std::int64_t number) {
    const auto corner = static_cast<std::uint32_t>(number);
    const auto [found, is_new] = number_of.try_emplace(corner, static_cast<std::uint32_t>(vertices_.size()));
    if (is_new) vertices_.push_back({.corner = {corner, kNone, kNone, kNone}, .weight = {1, 0, 0, 0}});
    return found->second;
  };
  const glm::i64vec3 of_cells = lattice - std::int64_t{1};
  for (const std::uint64_t cell : cells) {
    const auto n = static_cast<std::int64_t>(cell);
    const glm::i64vec3 at(n % of_cells.x, n / of_cells.x % of_cells.y, n / (of_cells.x * of_cells.y));
    for (int t = 0; t < kTetrahedraPerCell; ++t) {
      const TetrahedronCorners corners = tetrahedron_corners(t, (at.x + at.y + at.z) % 2 != 0);
      const auto vertex = [&](int c) {
        return vertex_at(at.x + (c & 1) + lattice.x * (at.y + (c >> 1 & 1) + lattice.y * (at.z + (c >> 2))));
      };
      tetrahedra_.push_back({{vertex(corners.a), vertex(corners.b), vertex(corners.c), vertex(corners.d)}, cell});
    }
  }
}

std::uint32_t TetrahedronSplitter::on_edge(std::uint32_t a, std::uint32_t b) const {
  const auto found = on_edge_.find({std::min(a, b), std::max(a, b), 0});
  return found == on_edge_.end() ? kNone : found->second;
}

std::uint32_t TetrahedronSplitter::add_mean(std::span<const std::uint32_t> of, std::span<const double> weights) {
  Vertex mean;
  const auto place_of = [&](std::uint32_t corner) {
    std::size_t n = 0;
    while (n < 4 && mean.corner[n] != corner && mean.corner[n] != kNone) ++n;
    mean.corner[n] = corner;
    return n;
  };
  for (std::size_t v = 0; v < of.size(); ++v) {
    const Vertex& part = vertices_[of[v]];
    for (std::size_t n = 0; n < 4 && part.corner[n] != kNone; ++n) {
      mean.weight[place_of(part.corner[n])] += weights[v] * part.weight[n];
    }
  }
  std::array<std::pair<std::uint32_t, double>, 4> pairs;
  for (std::size_t n = 0; n < 4; ++n) pairs[n] = {mean.corner[n], mean.weight[n]};
  std::sort(pairs.begin(), pairs.end());
  for (std::size_t n = 0; n < 4; ++n) std::tie(mean.corner[n], mean.weight[n]) = pairs[n];
  vertices_.push_back(mean);
  return static_cast<std::uint32_t>(vertices_.size() - 1);
}

void TetrahedronSplitter::cut(const std::function<double(std::uint32_t)>& side, double nearest,
                              const std::function<bool(std::uint64_t)>& is_through) {
  side_.clear();
  for (const Vertex& vertex : vertices_) {
    const double of_vertex = vertex.mean(side);
    side_.push_back(std::copysign(std::max(std::fabs(of_vertex), nearest), of_vertex));
  }
  mark_edges(is_through);
  std::vector<Tetrahedron> result;
  for (const Tetrahedron& t : tetrahedra_) split(t, is_through(t.cell), result);
  tetrahedra_ = std::move(result);
  on_edge_.clear();
}

void TetrahedronSplitter::mark_edges(const std::function<bool(std::uint64_t)>& is_through) {
  for (const Tetrahedron& t : tetrahedra_) {
    if (!is_through(t.cell)) continue;
    for (const auto& edge : kEdges) {
      const auto [a, b] =
          std::minmax(t.vertex[static_cast<std::size_t>(edge[0])], t.vertex[static_cast<std::size_t>(edge[1])]);
      if ((side_[a] < 0) == (side_[b] < 0) || on_edge(a, b) != kNone) continue;
      const double part = side_[a] / (side_[a] - side_[b]);
      const std::array<std::uint32_t, 2> ends{a, b};
      on_edge_[{a, b, 0}] = add_mean(ends, std::array{1 - part, part});
    }
  }
}

void TetrahedronSplitter::split(const Tetrahedron& whole, bool is_through, std::vector<Tetrahedron>& result) {
  const auto is_marked = [&](const auto& edge) {
    return on_edge(whole.vertex[static_cast<std::size_t>(edge[0])], whole.vertex[static_cast<std::size_t>(edge[1])]) !=
           kNone;
  };
  if (std::none_of(std::begin(kEdges), std::end(kEdges), is_marked)) {
    result.push_back(whole);
    return;
  }
  Skin above, below;
  for (const auto& face : kFaces) {
    split_face(whole.vertex[static_cast<std::size_t>(face[0])], whole.vertex[static_cast<std::size_t>(face[1])],
               whole.vertex[static_cast<std::size_t>(face[2])], above, below);
  }
  if (is_through) {
    sever(whole, above, below);
    fill(below, whole.cell, result);
  } else {
    above.insert(above.end(), below.begin(), below.end());
  }
  fill(above, whole.cell, result);
}

/// Splits a face at the marks on its edges, in the same way from both of its sides.
void TetrahedronSplitter::split_face(std::uint32_t a, std::uint32_t b, std::uint32_t c, Skin& above, Skin& below) {
  const auto skin_of = [&](std::uint32_t vertex) -> Skin& { return side_[vertex] < 0 ? below : above; };
  const std::uint32_t round[3] = {a, b, c};
  std::uint32_t mark[3];  // the mark on the edge after each vertex
  int marks = 0;
  for (int n = 0; n < 3; ++n) {
    mark[n] = on_edge(round[n], round[(n + 1) % 3]);
    marks += mark[n] != kNone;
  }
  Skin pieces;
  if (marks == 0) {
    skin_of(a).push_back(sorted(a, b, c));
    return;
  }
  if (marks == 1) {
    const int n = mark[0] != kNone ? 0 : mark[1] != kNone ? 1 : 2;
    const std::uint32_t first = round[n], second = round[(n + 1) % 3], across = round[(n + 2) % 3];
    pieces = {sorted(first, mark[n], across), sorted(mark[n], second, across)};
    for (int side = 0; side < 2; ++side)
      skin_of(side ? second : first).push_back(pieces[static_cast<std::size_t>(side)]);
  } else {
    const int n = mark[0] == kNone ? 2 : mark[1] == kNone ? 0 : 1;  // the vertex between the two marks
    const std::uint32_t alone = round[n], next = round[(n + 1) % 3], before = round[(n + 2) % 3];
    const std::uint32_t to_next = mark[n], to_before = mark[(n + 2) % 3];
    pieces.push_back(sorted(alone, to_next, to_before));
    add_quadrilateral({to_next, next, before, to_before}, pieces);
    skin_of(alone).push_back(pieces[0]);
    skin_of(next).insert(skin_of(next).end(), pieces.begin() + 1, pieces.end());
  }
  if (is_severed(sorted(a, b, c))) severed_.insert(pieces.begin(), pieces.end());
}

/// Closes both parts of a tetrahedron by the section of the cut with it.
void TetrahedronSplitter::sever(const Tetrahedron& whole, Skin& above, Skin& below) {
  std::vector<std::uint32_t> up, down;
  for (const std::uint32_t vertex : whole.vertex) (side_[vertex] < 0 ? down : up).push_back(vertex);
  Skin section;
  if (up.size() == 2) {
    add_quadrilateral(
        {on_edge(up[0], down[0]), on_edge(up[0], down[1]), on_edge(up[1], down[1]), on_edge(up[1], down[0])}, section);
  } else {
    const std::uint32_t alone = up.size() == 1 ? up[0] : down[0];
    const std::vector<std::uint32_t>& others = up.size() == 1 ? down : up;
    section.push_back(sorted(on_edge(alone, others[0]), on_edge(alone, others[1]), on_edge(alone, others[2])));
  }
  for (const Triangle& triangle : section) {
    severed_.insert(triangle);
    above.push_back(triangle);
    below.push_back(triangle);
  }
}

/// Adds the tetrahedra of a part: those between its middle and each triangle of its skin, or, if it has four corners,
/// itself.
void TetrahedronSplitter::fill(const Skin& skin, std::uint64_t cell, std::vector<Tetrahedron>& result) {
  std::vector<std::uint32_t> corners;
  for (const Triangle& triangle : skin) corners.insert(corners.end(), triangle.begin(), triangle.end());
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  if (corners.size() == 4) {
    result.push_back({{corners[0], corners[1], corners[2], corners[3]}, cell});
    return;
  }
  const std::vector<double> weights(corners.size(), 1.0 / static_cast<double>(corners.size()));
  const std::uint32_t middle = add_mean(corners, weights);
  for (const Triangle& t : skin) result.push_back({{t[0], t[1], t[2], middle}, cell});
}

}  // namespace tetwarp::simulate
