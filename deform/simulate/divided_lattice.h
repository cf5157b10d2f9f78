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

/// A lattice that cuts go through.
///
/// Each side of a cut gets vertices of its own (virtual nodes: Molino, Bao, Fedkiw, "A virtual node algorithm for
/// changing mesh topology during simulation", 2004): a divided cell is there once for each of its pieces, with all
/// eight corners, and pieces share a corner where their tissue goes on across a face. The piece that holds the corner
/// itself has the lattice's vertex, the others have copies of it. Inside a cell the cut is where its signed distance,
/// known at the corners, changes sign in the lattice's five tetrahedra: planes are exact, bends are cut short by part
/// of a cell. A cell is divided where the middle of the cut through it lies within the cut's rim.
struct DividedLattice {
  /// A vertex of the mesh: the mean of nodes.
  struct Vertex {
    std::array<std::uint32_t, 4> node{};
    std::array<double, 4> weight{};  ///< 0 for those that are not there
  };

  std::vector<std::uint32_t> copies_of;  ///< lattice vertex of each node after the lattice's
  std::vector<CellPiece> pieces;         ///< of cells with several pieces or with copies, by rising cell
  std::vector<std::string> cuts;         ///< names
  /// Of each piece, on which side of each of `cuts` it lies: -1 or 1, 0 where that cut does not go through its cell.
  std::vector<std::vector<std::int8_t>> sides;
  std::vector<std::uint64_t> replaced;   ///< cells that the mesh takes the place of, rising: those that a cut goes
                                         ///< through or touches
  std::vector<Vertex> vertices;          ///< of that mesh
  std::vector<glm::u32vec4> tetrahedra;  ///< by rising cell
};

/// Where the cut passes nearer to a lattice vertex than 1/256 of the shortest side of a cell it is moved away to there.
/// Cuts may cross. Without a cut in reach the result is empty.
/// @throws InputError for cuts as CutSurface does
DividedLattice divide(const Geometry& lattice, std::span<const Cut> cuts);

/// Where other cuts are made: for each copy of a divided lattice, the node of the one before that held the same tissue.
/// It is a node of the same corner and cell, of the piece on the same sides of the cuts that both have, of several the
/// largest; where the cell was whole, the lattice's vertex. Of both lattices the vertices are the same.
std::vector<std::uint32_t> nodes_before(const DividedLattice& now, const DividedLattice& before,
                                        const Geometry& lattice);

/// The field in which the nodes of a divided lattice are displaced: VertexField::replaced and mesh say what became of
/// the divided cells. @param displacement  LPS mm of each node
VertexField field_of(const Geometry& lattice, const DividedLattice& divided, std::span<const glm::vec3> displacement);

}  // namespace tetwarp::simulate
