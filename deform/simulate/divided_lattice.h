// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <string>
#include <vector>

#include "deform/simulate/cut.h"
#include "deform/simulate/model.h"
#include "deform/vertex_field.h"

namespace tetwarp::simulate {

/// A lattice through which cuts go.
///
/// Each side of a cut gets vertices of its own (virtual nodes: Molino, Bao and Fedkiw, "A virtual node algorithm for
/// changing mesh topology during simulation", 2004). A divided cell exists once for each of its pieces, with all eight
/// corners, and pieces of neighbouring cells share a corner where tissue continues across their face. The piece that
/// contains a corner has the lattice's vertex there; other pieces have copies of it. Inside a cell the cut lies where
/// its signed distance, known at the corners, changes sign in the five tetrahedra of the cell: planes are exact, bends
/// are rounded off within a cell. A cell is divided where the middle of the cut through it lies within the rim of the
/// cut.
struct DividedLattice {
  /// A vertex of the mesh: a weighted mean of up to four nodes.
  struct Vertex {
    std::array<std::uint32_t, 4> node{};  ///< node numbers
    std::array<double, 4> weight{};       ///< their weights; 0 for entries that are not used
  };

  /// Lattice vertex of each copy; copies are the nodes after those of the lattice.
  std::vector<std::uint32_t> copies_of;
  std::vector<CellPiece> pieces;  ///< pieces of the cells that have several pieces or copies, ordered by cell
  std::vector<std::string> cuts;  ///< names of the cuts
  /// For each piece, on which side of each of `cuts` it lies: -1 or 1, or 0 where that cut does not go through its
  /// cell.
  std::vector<std::vector<std::int8_t>> sides;
  /// Numbers (i fastest, rising) of the cells that a cut goes through or touches; the mesh takes their place.
  std::vector<std::uint64_t> replaced;
  std::vector<Vertex> vertices;          ///< vertices of the mesh
  std::vector<glm::u32vec4> tetrahedra;  ///< tetrahedra of the mesh, ordered by cell
};

/// Divides a lattice by cuts, which may cross. Where a cut passes a lattice vertex at less than 1/256 of the shortest
/// side of a cell, it is moved away to that distance. If no cut reaches the lattice the result is empty.
/// @param lattice  grid of the undeformed vertices
/// @param cuts     surfaces
/// @throws InputError for a cut with numbers that are not finite, a normal or path without length, or a radius that is
///         not positive
DividedLattice divide(const Geometry& lattice, std::span<const Cut> cuts);

/// For each copy of a lattice that was divided anew by other cuts: the node of the division before that held the same
/// tissue. It is a node of the same corner and cell, of the largest piece on the same sides of the cuts that both
/// divisions have; where the cell was whole, the lattice's vertex.
std::vector<std::uint32_t> nodes_before(const DividedLattice& now, const DividedLattice& before,
                                        const Geometry& lattice);

/// The field of a divided lattice whose nodes are displaced: `VertexField::replaced` and `VertexField::mesh` describe
/// the divided cells.
/// @param lattice       grid of the undeformed vertices
/// @param divided       its division
/// @param displacement  LPS mm of each node
VertexField field_of(const Geometry& lattice, const DividedLattice& divided, std::span<const glm::vec3> displacement);

}  // namespace tetwarp::simulate
