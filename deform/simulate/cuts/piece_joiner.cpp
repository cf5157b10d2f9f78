// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/cuts/piece_joiner.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <map>
#include <numeric>
#include <unordered_map>

namespace tetwarp::simulate {

namespace {

constexpr std::uint32_t kNone = TetrahedronSplitter::kNone;

/// Sets of things that were joined (union-find); the least number stands for each set.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t of(std::uint32_t n) {
    while (parent_[n] != n) n = parent_[n] = parent_[parent_[n]];
    return n;
  }
  void unite(std::uint32_t a, std::uint32_t b) {
    a = of(a);
    b = of(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// One run of `join_pieces`.
class Joiner {
 public:
  Joiner(const Geometry& lattice, const LatticeNumbers& grid, const TetrahedronSplitter& split,
         std::span<const LatticeCut> divisions)
      : lattice_(lattice), grid_(grid), split_(split), divisions_(divisions), pieces_(split.tetrahedra().size()) {
    join_tetrahedra();
    number_pieces();
    nodes_ = Sets(cell_of_.size() * kCorners);
    join_corners();
    number_nodes();
  }

  DividedLattice result() {
    DividedLattice divided;
    divided.copies_of = copies_of_;
    add_pieces(divided);
    add_mesh(divided);
    return divided;
  }

 private:
  using Triangle = TetrahedronSplitter::Triangle;

  /// Calls `visit` with the two tetrahedra at every face that no cut severs.
  template <class Visit>
  void for_each_joint(Visit&& visit) const {
    std::map<Triangle, std::uint32_t> open;
    const auto& tetrahedra = split_.tetrahedra();
    for (std::uint32_t n = 0; n < tetrahedra.size(); ++n) {
      const auto& v = tetrahedra[n].vertex;
      for (const auto& face :
           {std::array{v[0], v[1], v[2]}, {v[0], v[1], v[3]}, {v[0], v[2], v[3]}, {v[1], v[2], v[3]}}) {
        Triangle key = face;
        std::sort(key.begin(), key.end());
        if (split_.is_severed(key)) continue;
        const auto [found, is_first] = open.try_emplace(key, n);
        if (is_first) continue;
        visit(found->second, n);
        open.erase(found);
      }
    }
  }

  void join_tetrahedra() {
    for_each_joint([&](std::uint32_t a, std::uint32_t b) {
      if (split_.tetrahedra()[a].cell == split_.tetrahedra()[b].cell) pieces_.unite(a, b);
    });
  }

  void number_pieces() {
    const auto& tetrahedra = split_.tetrahedra();
    piece_.assign(tetrahedra.size(), 0);
    for (std::uint32_t n = 0; n < tetrahedra.size(); ++n) {
      const std::uint32_t first = pieces_.of(n);
      if (first == n) {
        piece_[n] = static_cast<std::uint32_t>(cell_of_.size());
        cell_of_.push_back(tetrahedra[n].cell);
      } else {
        piece_[n] = piece_[first];
      }
    }
  }

  std::uint32_t place(std::uint32_t piece, std::uint32_t corner) const { return piece * kCorners + corner; }

  void join_corners() {
    for_each_joint([&](std::uint32_t a, std::uint32_t b) {
      const std::uint32_t of_a = piece_[a], of_b = piece_[b];
      if (of_a == of_b) return;
      const glm::i64vec3 steps = grid_.place_of_cell(cell_of_[of_b]) - grid_.place_of_cell(cell_of_[of_a]);
      for (std::uint32_t c = 0; c < kCorners; ++c) {
        const glm::i64vec3 in_b = corner_steps(c) - steps;
        if (in_b.x < 0 || in_b.x > 1 || in_b.y < 0 || in_b.y > 1 || in_b.z < 0 || in_b.z > 1) continue;
        nodes_.unite(place(of_a, c), place(of_b, static_cast<std::uint32_t>(in_b.x + 2 * in_b.y + 4 * in_b.z)));
      }
    });
    const auto& tetrahedra = split_.tetrahedra();
    for (std::uint32_t n = 0; n < tetrahedra.size(); ++n) {
      for (const std::uint32_t v : tetrahedra[n].vertex) {
        const TetrahedronSplitter::Vertex& vertex = split_.vertices()[v];
        if (!vertex.is_corner()) continue;
        const std::uint32_t at = place(piece_[n], corner_of(cell_of_[piece_[n]], vertex.corner[0]));
        nodes_.unite(holder_.try_emplace(vertex.corner[0], at).first->second, at);
      }
    }
  }

  std::uint32_t corner_of(std::uint64_t cell, std::uint32_t vertex) const {
    const glm::i64vec3 at = grid_.place_of_vertex(vertex) - grid_.place_of_cell(cell);
    return static_cast<std::uint32_t>(at.x + 2 * at.y + 4 * at.z);
  }

  void number_nodes() {
    node_.assign(cell_of_.size() * kCorners, kNone);
    for (const auto& [vertex, at] : holder_) node_[nodes_.of(at)] = vertex;
    auto next = static_cast<std::uint32_t>(voxel_count(lattice_));
    for (std::uint32_t at = 0; at < node_.size(); ++at) {
      std::uint32_t& node = node_[nodes_.of(at)];
      if (node == kNone) {
        node = next++;
        copies_of_.push_back(grid_.vertex(cell_of_[at / kCorners], at % kCorners));
      }
      node_[at] = node;
    }
  }

  double volume_of(const TetrahedronSplitter::Tetrahedron& t) const {
    std::array<glm::dvec3, 4> at;
    for (std::size_t n = 0; n < 4; ++n) {
      for (int axis = 0; axis < 3; ++axis) {
        at[n][axis] = split_.vertices()[t.vertex[n]].mean(
            [&](std::uint32_t corner) { return static_cast<double>(grid_.place_of_vertex(corner)[axis]); });
      }
    }
    return std::fabs(glm::determinant(glm::dmat3(at[0] - at[3], at[1] - at[3], at[2] - at[3]))) / 6;
  }

  /// For each piece, the side of a cut on which it lies. No piece within a cell that the cut goes through lies on both
  /// sides.
  std::vector<std::int8_t> sides_of(const LatticeCut& division) const {
    std::vector<double> sum(cell_of_.size());
    const auto& tetrahedra = split_.tetrahedra();
    for (std::size_t n = 0; n < tetrahedra.size(); ++n) {
      double side = 0;
      for (const std::uint32_t v : tetrahedra[n].vertex)
        side += split_.vertices()[v].mean([&](std::uint32_t corner) { return division.side[corner]; });
      sum[piece_[n]] += side * volume_of(tetrahedra[n]);
    }
    std::vector<std::int8_t> sides;
    for (std::size_t piece = 0; piece < sum.size(); ++piece)
      sides.push_back(static_cast<std::int8_t>(!division.is_through(cell_of_[piece]) ? 0 : sum[piece] < 0 ? -1 : 1));
    return sides;
  }

  void add_pieces(DividedLattice& divided) const {
    std::vector<double> volume(cell_of_.size());
    const auto& tetrahedra = split_.tetrahedra();
    for (std::size_t n = 0; n < tetrahedra.size(); ++n) volume[piece_[n]] += volume_of(tetrahedra[n]);
    std::vector<std::vector<std::int8_t>> sides;
    for (const LatticeCut& division : divisions_) sides.push_back(sides_of(division));
    for (std::uint32_t first = 0, end = 0; first < cell_of_.size(); first = end) {
      while (end < cell_of_.size() && cell_of_[end] == cell_of_[first]) ++end;
      bool is_whole = end - first == 1;
      for (std::uint32_t c = 0; c < kCorners && is_whole; ++c) {
        is_whole = node_[place(first, c)] == grid_.vertex(cell_of_[first], c);
      }
      for (std::uint32_t piece = first; piece < end && !is_whole; ++piece) {
        CellPiece& added = divided.pieces.emplace_back();
        added.cell = cell_of_[piece];
        added.volume = volume[piece];
        for (std::uint32_t c = 0; c < kCorners; ++c) added.node[c] = node_[place(piece, c)];
        std::vector<std::int8_t>& of_piece = divided.sides.emplace_back();
        for (const std::vector<std::int8_t>& of_cut : sides) of_piece.push_back(of_cut[piece]);
      }
    }
  }

  void add_mesh(DividedLattice& divided) const {
    std::map<std::pair<std::uint32_t, std::array<std::uint32_t, 4>>, std::uint32_t> number_of;
    const auto& tetrahedra = split_.tetrahedra();
    for (std::size_t first = 0, end = 0; first < tetrahedra.size(); first = end) {
      const std::uint64_t cell = tetrahedra[first].cell;
      bool is_whole = true;
      for (; end < tetrahedra.size() && tetrahedra[end].cell == cell; ++end) {
        for (const std::uint32_t v : tetrahedra[end].vertex) is_whole &= split_.vertices()[v].is_corner();
      }
      if (is_whole) continue;
      divided.replaced.push_back(cell);
      for (std::size_t n = first; n < end; ++n) {
        glm::u32vec4 corners;
        for (int c = 0; c < 4; ++c) {
          const std::uint32_t v = tetrahedra[n].vertex[static_cast<std::size_t>(c)];
          const DividedLattice::Vertex vertex = vertex_in(piece_[n], split_.vertices()[v]);
          const auto [found, is_new] =
              number_of.try_emplace({v, vertex.node}, static_cast<std::uint32_t>(divided.vertices.size()));
          if (is_new) divided.vertices.push_back(vertex);
          corners[c] = found->second;
        }
        divided.tetrahedra.push_back(corners);
      }
    }
  }

  DividedLattice::Vertex vertex_in(std::uint32_t piece, const TetrahedronSplitter::Vertex& vertex) const {
    DividedLattice::Vertex result;
    result.weight = vertex.weight;
    for (std::size_t n = 0; n < 4 && vertex.corner[n] != kNone; ++n) {
      result.node[n] = node_[place(piece, corner_of(cell_of_[piece], vertex.corner[n]))];
    }
    return result;
  }

  const Geometry& lattice_;
  const LatticeNumbers& grid_;
  const TetrahedronSplitter& split_;
  const std::span<const LatticeCut> divisions_;
  Sets pieces_;                         ///< joins tetrahedra to pieces
  std::vector<std::uint32_t> piece_;    ///< by tetrahedron: its piece
  std::vector<std::uint64_t> cell_of_;  ///< by piece: its cell
  Sets nodes_{0};                       ///< joins places, each a corner of a piece, to nodes
  /// By lattice vertex: the place in the piece that holds it.
  std::unordered_map<std::uint32_t, std::uint32_t> holder_;
  std::vector<std::uint32_t> node_;  ///< by place: its node
  std::vector<std::uint32_t> copies_of_;
};

}  // namespace

DividedLattice join_pieces(const Geometry& lattice, const LatticeNumbers& grid, const TetrahedronSplitter& split,
                           std::span<const LatticeCut> divisions) {
  return Joiner(lattice, grid, split, divisions).result();
}

}  // namespace tetwarp::simulate
