// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/divided_lattice.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <map>
#include <numeric>
#include <unordered_map>

#include "deform/errors.h"
#include "deform/simulate/cuts/cut_surface.h"
#include "deform/simulate/cuts/tetrahedron_splitter.h"

namespace tetwarp::simulate {

namespace {

constexpr std::uint32_t kCorners = 8;
constexpr std::uint32_t kNone = TetrahedronSplitter::kNone;

glm::i64vec3 corner_steps(std::uint32_t c) { return {c & 1, c >> 1 & 1, c >> 2}; }

/// Numbers of vertices and cells of a lattice.
class LatticeNumbers {
 public:
  explicit LatticeNumbers(const Geometry& lattice) : size_(lattice.size), cells_(lattice.size - std::int64_t{1}) {}

  const glm::i64vec3& size() const { return size_; }
  const glm::i64vec3& cells() const { return cells_; }
  std::uint64_t cell(const glm::i64vec3& at) const {
    return static_cast<std::uint64_t>(at.x + cells_.x * (at.y + cells_.y * at.z));
  }
  glm::i64vec3 place_of_cell(std::uint64_t cell) const { return place(cell, cells_); }
  glm::i64vec3 place_of_vertex(std::uint32_t vertex) const { return place(vertex, size_); }
  std::uint32_t vertex(const glm::i64vec3& at) const {
    return static_cast<std::uint32_t>(at.x + size_.x * (at.y + size_.y * at.z));
  }
  /// The number of the vertex at a corner of a cell.
  std::uint32_t vertex(std::uint64_t cell, std::uint32_t corner) const {
    return vertex(place_of_cell(cell) + corner_steps(corner));
  }

 private:
  static glm::i64vec3 place(std::uint64_t number, const glm::i64vec3& size) {
    const auto n = static_cast<std::int64_t>(number);
    return {n % size.x, n / size.x % size.y, n / (size.x * size.y)};
  }

  glm::i64vec3 size_, cells_;
};

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

/// One cut through the lattice: the side on which each vertex lies, and the cells that the cut goes through.
struct LatticeCut {
  std::vector<double> side;
  std::vector<std::uint64_t> cells;  ///< rising
  double nearest = 0;                ///< mm: the least distance of the cut from a vertex

  bool is_through(std::uint64_t cell) const { return std::binary_search(cells.begin(), cells.end(), cell); }
};

LatticeCut divide_by(const Geometry& lattice, const LatticeNumbers& grid, const Cut& cut) {
  constexpr double kNearest = 1.0 / 256;  // of the shortest side of a cell
  const CutSurface surface(cut);
  const AffineMap point = point_from_index(lattice);
  const glm::dvec3& h = lattice.spacing;
  const double farthest = 0.5 * std::max({h.x, h.y, h.z});
  LatticeCut division;
  division.nearest = kNearest * std::min({h.x, h.y, h.z});
  const auto vertices = static_cast<std::uint32_t>(voxel_count(lattice));
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const double side = surface.side(point(glm::dvec3(grid.place_of_vertex(v))));
    division.side.push_back(std::copysign(std::max(std::fabs(side), division.nearest), side));
  }
  const auto cells = static_cast<std::uint64_t>(grid.cells().x * grid.cells().y * grid.cells().z);
  for (std::uint64_t cell = 0; cell < cells; ++cell) {
    glm::dvec3 sum(0);  // sum of the places where the cut goes through edges, lattice index
    int crossings = 0;
    for (std::uint32_t a = 0; a < kCorners; ++a) {
      for (const std::uint32_t axis : {1u, 2u, 4u}) {
        if (a & axis) continue;
        const std::uint32_t from = grid.vertex(cell, a), to = grid.vertex(cell, a | axis);
        const double at = division.side[from], other = division.side[to];
        if ((at < 0) == (other < 0)) continue;
        sum +=
            glm::mix(glm::dvec3(grid.place_of_vertex(from)), glm::dvec3(grid.place_of_vertex(to)), at / (at - other));
        ++crossings;
      }
    }
    if (crossings == 0) continue;
    const glm::dvec3 middle = point(sum / static_cast<double>(crossings));
    if (std::fabs(surface.side(middle)) <= farthest && surface.reaches(middle)) division.cells.push_back(cell);
  }
  return division;
}

/// The cells that cuts go through, and all cells around them.
std::vector<std::uint64_t> with_neighbours(const LatticeNumbers& grid, const std::vector<LatticeCut>& divisions) {
  std::vector<std::uint64_t> result;
  for (const LatticeCut& division : divisions) {
    for (const std::uint64_t cell : division.cells) {
      const glm::i64vec3 at = grid.place_of_cell(cell);
      const glm::i64vec3 low = glm::max(at - std::int64_t{1}, glm::i64vec3(0)),
                         high = glm::min(at + std::int64_t{1}, grid.cells() - std::int64_t{1});
      for (std::int64_t k = low.z; k <= high.z; ++k) {
        for (std::int64_t j = low.y; j <= high.y; ++j) {
          for (std::int64_t i = low.x; i <= high.x; ++i) result.push_back(grid.cell({i, j, k}));
        }
      }
    }
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

/// Finds out which tetrahedra and corners belong together when all cuts are made, and numbers the nodes.
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

DividedLattice divide(const Geometry& lattice, std::span<const Cut> cuts) {
  require_valid(lattice, "the lattice");
  require(voxel_count(lattice) < INT32_MAX,
          "a lattice of " + to_string(lattice.size) + " vertices is too large to cut");
  const LatticeNumbers grid(lattice);
  std::vector<LatticeCut> divisions;
  for (const Cut& cut : cuts) divisions.push_back(divide_by(lattice, grid, cut));
  TetrahedronSplitter split(lattice.size, with_neighbours(grid, divisions));
  for (const LatticeCut& division : divisions) {
    split.cut([&](std::uint32_t vertex) { return division.side[vertex]; }, division.nearest,
              [&](std::uint64_t cell) { return division.is_through(cell); });
  }
  DividedLattice divided = Joiner(lattice, grid, split, divisions).result();
  for (const Cut& cut : cuts) divided.cuts.push_back(cut.name);
  return divided;
}

namespace {

/// How many of the cuts that two divided lattices share have the two pieces on different sides.
int other_sides(const DividedLattice& now, std::size_t piece, const DividedLattice& before, std::size_t earlier) {
  int count = 0;
  for (std::size_t cut = 0; cut < now.cuts.size(); ++cut) {
    const auto found = std::find(before.cuts.begin(), before.cuts.end(), now.cuts[cut]);
    if (found == before.cuts.end()) continue;
    const auto at = static_cast<std::size_t>(found - before.cuts.begin());
    count += now.sides[piece][cut] * before.sides[earlier][at] < 0;
  }
  return count;
}

}  // namespace

std::vector<std::uint32_t> nodes_before(const DividedLattice& now, const DividedLattice& before,
                                        const Geometry& lattice) {
  const auto vertices = static_cast<std::uint32_t>(voxel_count(lattice));
  std::vector<std::uint32_t> nodes = now.copies_of;  // the answer where the cell was whole before
  std::vector<bool> is_known(nodes.size());
  const auto is_before = [](const CellPiece& piece, std::uint64_t cell) { return piece.cell < cell; };
  for (std::size_t piece = 0; piece < now.pieces.size(); ++piece) {
    const CellPiece& of_now = now.pieces[piece];
    auto best = before.pieces.end();
    int fewest = 0;
    for (auto one = std::lower_bound(before.pieces.begin(), before.pieces.end(), of_now.cell, is_before);
         one != before.pieces.end() && one->cell == of_now.cell; ++one) {
      const int others = other_sides(now, piece, before, static_cast<std::size_t>(one - before.pieces.begin()));
      if (best != before.pieces.end() && (others > fewest || (others == fewest && one->volume <= best->volume)))
        continue;
      best = one;
      fewest = others;
    }
    for (std::size_t c = 0; c < kCorners; ++c) {
      if (of_now.node[c] < vertices || is_known[of_now.node[c] - vertices]) continue;
      is_known[of_now.node[c] - vertices] = true;
      if (best != before.pieces.end()) nodes[of_now.node[c] - vertices] = best->node[c];
    }
  }
  return nodes;
}

VertexField field_of(const Geometry& lattice, const DividedLattice& divided, std::span<const glm::vec3> displacement) {
  const auto vertices = static_cast<std::size_t>(voxel_count(lattice));
  const std::size_t nodes = vertices + divided.copies_of.size();
  require(displacement.size() == nodes, "one displacement a node is expected, " + std::to_string(nodes) + "; found " +
                                            std::to_string(displacement.size()));
  const LatticeNumbers grid(lattice);
  const AffineMap point = point_from_index(lattice);
  VertexField field{
      .lattice = lattice,
      .displacement = {displacement.begin(), displacement.begin() + static_cast<std::ptrdiff_t>(vertices)},
      .mesh = {},
      .replaced = divided.replaced};
  for (const DividedLattice::Vertex& vertex : divided.vertices) {
    glm::dvec3 rest(0), moved(0);
    std::int64_t of_lattice = -1;
    for (std::size_t n = 0; n < 4; ++n) {
      if (vertex.weight[n] == 0) continue;
      const std::uint32_t node = vertex.node[n];
      const std::uint32_t at = node < vertices ? node : divided.copies_of[node - vertices];
      if (vertex.weight[n] == 1) of_lattice = at;
      rest += vertex.weight[n] * point(glm::dvec3(grid.place_of_vertex(at)));
      moved += vertex.weight[n] * glm::dvec3(displacement[node]);
    }
    field.mesh.rest.push_back(rest);
    field.mesh.displacement.emplace_back(moved);
    field.mesh.lattice_vertex.push_back(of_lattice);
  }
  field.mesh.tetrahedra = divided.tetrahedra;
  return field;
}

}  // namespace tetwarp::simulate
