// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "deform/geometry.h"

namespace tetwarp::simulate {

/// Links of a node: to the 26 neighbours of its vertex on the lattice.
inline constexpr int kDirections = 26;

/// Steps along i, j, k to the neighbour in a direction; 25 - d is the way back from d.
TETWARP_HD constexpr glm::ivec3 link_steps(int direction) {
  const int n = direction < kDirections / 2 ? direction : direction + 1;
  return {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
}
TETWARP_HD constexpr int opposite(int direction) { return kDirections - 1 - direction; }
/// The direction of some steps, each -1, 0 or 1 and not all 0.
TETWARP_HD constexpr int direction_of(int i, int j, int k) {
  const int n = (i + 1) + 3 * (j + 1) + 9 * (k + 1);
  return n > kDirections / 2 ? n - 1 : n;
}
/// The direction one step up an axis: chainmail's links.
TETWARP_HD constexpr int direction_up(int axis) { return direction_of(axis == 0, axis == 1, axis == 2); }

/// What a kind of tissue resists, and how far chainmail lets its links go.
struct Tissue {
  std::string name;
  double youngs_modulus_kpa = 10;
  double compression = 0.2;  ///< a link shrinks by this part of its length at most
  double stretch = 0.2;      ///< and grows by this
  double shear = 0.2;        ///< and its ends shift across it by this, on either of the other axes
};

/// What a chainmail link allows: how the displacements of its upper and lower end may differ, mm along the lattice's
/// axes. Along its own axis from `shortest` (<= 0) to `longest` (>= 0); across it by `shear` (>= 0) either way.
struct LinkLimits {
  float shortest = 0, longest = 0, shear = 0;
};

/// A cell that a cut divides, one for each piece.
struct CellPiece {
  std::uint64_t cell = 0;             ///< number on the lattice, i fastest
  std::array<std::uint32_t, 8> node;  ///< of each corner; corner c is at (c & 1, c >> 1 & 1, c >> 2) of the cell
  double volume = 1;                  ///< part of the cell's
};

/// What a simulation moves: the vertices of a lattice with, where cuts divide cells, further copies of some, and the
/// links between them.
///
/// A node is a vertex or a copy. Springs run along all links; chainmail's limits are those of the links along axes.
struct Model {
  Geometry lattice;                     ///< at rest
  std::vector<std::uint32_t> vertex;    ///< of each node: its lattice vertex, i fastest; first all vertices in order
  std::vector<std::int32_t> neighbour;  ///< at direction * nodes() + node; -1: no link
  std::vector<float> stiffness;         ///< N/mm, likewise; 0 where there is no link; the same from both ends
  std::vector<LinkLimits> limits;       ///< at axis * nodes() + node: of the link up that axis

  std::size_t nodes() const { return vertex.size(); }
  std::size_t link(int direction, std::size_t node) const {
    return static_cast<std::size_t>(direction) * nodes() + node;
  }
};

/// Spring constants of a cell of a material with Young's modulus 1 N/mm2 and Poisson's ratio 1/4, N/mm.
///
/// With springs k_d along directions r_d, one each a cell of volume V, the elasticity is C_ijkl = (1/V) sum k_d r_i r_j
/// r_k r_l / |r|^2 (Cauchy's relations hold, so that the ratio is 1/4). Equal moduli along and across all axes give six
/// equations for the three axial, three face-diagonal and one body-diagonal constant; the share of the body diagonals
/// is free, and is 4/7 of the shear modulus where it is largest: in a cube all diagonals are then equal, k = 6/35 E h,
/// and the axial springs 11/3 of that. Where sides of cells differ so much that an axial constant would be negative it
/// is 0: such a lattice is stiffer along that axis.
struct SpringConstants {
  std::array<double, kDirections> along{};
};
SpringConstants spring_constants(const glm::dvec3& cell_mm);

/// Links of a lattice of tissue.
///
/// A spring's constant is the sum of what the cells round it give (a fourth of an axial spring each, half of a face's
/// diagonal, a body diagonal whole); its chainmail limits are the tightest of those cells. Of a divided cell each piece
/// links its own nodes, with springs of its part of the volume. A node has one neighbour in each direction: at the rim
/// of a cut, where a vertex would have two, the lattice's own is taken before copies.
///
/// @param tissue_of_cell  index into `tissues`, one a cell, i fastest
/// @param copies_of       lattice vertex of each copy beyond the vertices themselves: node numbers follow the lattice's
/// @param pieces          of the cells that cuts divide, by rising cell
/// @throws InputError for arrays that do not fit, a tissue with a modulus or limits out of range, or more than 2^31
/// nodes
Model make_model(const Geometry& lattice, std::span<const std::uint8_t> tissue_of_cell, std::span<const Tissue> tissues,
                 std::span<const std::uint32_t> copies_of = {}, std::span<const CellPiece> pieces = {});

/// LPS mm from a node to its neighbour in a direction, at rest.
glm::dvec3 rest_link(const Geometry& lattice, int direction);

}  // namespace tetwarp::simulate
