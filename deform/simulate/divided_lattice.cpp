// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/divided_lattice.h"

#include <algorithm>

#include "deform/errors.h"
#include "deform/simulate/cuts/lattice_cut.h"
#include "deform/simulate/cuts/piece_joiner.h"
#include "deform/simulate/cuts/tetrahedron_splitter.h"

namespace tetwarp::simulate {

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
  DividedLattice divided = join_pieces(lattice, grid, split, divisions);
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
