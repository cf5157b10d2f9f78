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

/// Number of links that a node can have: one to each of the 26 neighbours of its vertex on the lattice.
inline constexpr int kDirections = 26;

/// Steps along i, j, k (each -1, 0 or 1) to the neighbour in a direction (0 to 25). Direction 25 - d is opposite to d.
TETWARP_HD constexpr glm::ivec3 link_steps(int direction) {
  const int n = direction < kDirections / 2 ? direction : direction + 1;
  return {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
}
/// The direction back.
TETWARP_HD constexpr int opposite(int direction) { return kDirections - 1 - direction; }
/// The direction of steps along i, j, k, each -1, 0 or 1 and not all 0.
TETWARP_HD constexpr int direction_of(int i, int j, int k) {
  const int n = (i + 1) + 3 * (j + 1) + 9 * (k + 1);
  return n > kDirections / 2 ? n - 1 : n;
}
/// The direction one step up an axis. The links of ChainMail are these.
TETWARP_HD constexpr int direction_up(int axis) { return direction_of(axis == 0, axis == 1, axis == 2); }

/// How stiff a kind of tissue is, and how far ChainMail lets its links change.
struct Tissue {
  std::string name;                ///< name that messages use
  double youngs_modulus_kpa = 10;  ///< Young's modulus, kPa
  double compression = 0.2;        ///< the largest part of its length by which a link may shrink
  double stretch = 0.2;            ///< the largest part of its length by which a link may grow
  double shear = 0.2;  ///< the largest part of its length by which its ends may shift across it, along each other axis
};

/// What a ChainMail link allows: how far the displacement of its upper end may differ from that of its lower end, mm
/// along the lattice's axes.
struct LinkLimits {
  float shortest = 0,  ///< least difference along the link's axis, at most 0
      longest = 0,     ///< largest difference along the link's axis, at least 0
      shear = 0;       ///< largest difference across the link, either way, at least 0
};

/// A piece of a cell that cuts divide.
struct CellPiece {
  std::uint64_t cell = 0;             ///< number of the cell in the lattice, i fastest
  std::array<std::uint32_t, 8> node;  ///< node at each corner; corner c lies at (c & 1, c >> 1 & 1, c >> 2) of the cell
  double volume = 1;                  ///< share of the cell's volume
};

/// What a simulation moves: the vertices of a lattice, copies of some of them where cuts divide cells, and the links
/// between all these.
///
/// A node is a vertex or a copy. Springs run along all links; limits of ChainMail are those of the links along axes.
struct Model {
  Geometry lattice;  ///< grid of the undeformed vertices
  /// Lattice vertex (i fastest) of each node; nodes are all vertices in order, then the copies.
  std::vector<std::uint32_t> vertex;
  /// Neighbour of a node in a direction, at index `link(direction, node)`; -1: no link.
  std::vector<std::int32_t> neighbour;
  /// Spring constant of each link, N/mm, at the same index; 0 without a link; equal from both ends.
  std::vector<float> stiffness;
  std::vector<LinkLimits> limits;  ///< limits of the link up an axis, at index axis * nodes() + node

  /// Number of nodes.
  std::size_t nodes() const { return vertex.size(); }
  /// Index of a link in `neighbour` and `stiffness`.
  std::size_t link(int direction, std::size_t node) const {
    return static_cast<std::size_t>(direction) * nodes() + node;
  }
};

/// Spring constants, N/mm, of a cell of a material with Young's modulus 1 N/mm2 and Poisson's ratio 1/4.
///
/// With springs of constants k_d along directions r_d, one of each in a cell of volume V, the elasticity tensor is
/// C_ijkl = (1/V) sum k_d r_i r_j r_k r_l / |r|^2. It fulfils Cauchy's relations, hence the ratio of 1/4. Equal moduli
/// along and across all axes give six equations for three axial, three face-diagonal and one body-diagonal constant.
/// The share of the body diagonals is free; here it is 4/7 of the shear modulus where it is largest, because then all
/// diagonals of a cube are equal, k = 6/35 E h, and its axial springs are 11/3 of that. Where the sides of a cell
/// differ so much that an axial constant would be negative it is 0, and such a lattice is too stiff along that axis.
struct SpringConstants {
  std::array<double, kDirections> along{};  ///< constant of the spring in each direction, N/mm
};
/// The constants for a cell with these sides, mm.
SpringConstants spring_constants(const glm::dvec3& cell_mm);

/// Links the nodes of a lattice of tissue.
///
/// The constant of a spring is the sum of what the cells around it give: a quarter of an axial spring each, half of a
/// face diagonal, all of a body diagonal. Its ChainMail limits are the tightest of those cells. Each piece of a divided
/// cell links its own nodes, with springs in proportion to its volume. A node has one neighbour in each direction; at
/// the rim of a cut, where a vertex would have two, the vertex of the lattice precedes copies.
///
/// @param lattice         grid of the undeformed vertices
/// @param tissue_of_cell  for each cell, i fastest, an index into `tissues`
/// @param tissues         kinds of tissue
/// @param copies_of       lattice vertex of each copy; copies are numbered after the vertices
/// @param pieces          of the cells that cuts divide, ordered by cell
/// @throws InputError for arrays that do not fit, a tissue with a modulus or limit out of range, or more than 2^31
///         nodes
Model make_model(const Geometry& lattice, std::span<const std::uint8_t> tissue_of_cell, std::span<const Tissue> tissues,
                 std::span<const std::uint32_t> copies_of = {}, std::span<const CellPiece> pieces = {});

/// The vector, LPS mm, from an undeformed node to its neighbour in a direction.
glm::dvec3 rest_link(const Geometry& lattice, int direction);
/// How far the number of a vertex is from that of its neighbour in a direction.
std::ptrdiff_t link_distance(const Geometry& lattice, int direction);

}  // namespace tetwarp::simulate
