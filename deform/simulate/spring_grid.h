// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "deform/simulate/spring_solver.h"

namespace tetwarp::simulate {

/// A link that does not lead to the next vertex of the lattice, because a cut gave one of its ends a copy.
struct OddLink {
  std::uint32_t node, other;
  int direction;
  float stiffness;
};

/// Springs of a model in the form over which the CPU sweeps: those between vertices at fixed distances, without a table
/// of neighbours, and a list of the few others.
struct SpringGrid {
  /// Nodes that one call of a sweep goes over.
  static constexpr std::size_t kBlock = kSumBlock;
  /// Sweeps may read and write up to so many nodes after the last.
  static constexpr std::size_t kLanes = 32;

  std::size_t nodes = 0, padding = 0;  ///< padding: how far before the first node and after the last sweeps may read
  /// By direction kUp + d, with padding: spring constant of the link, N/mm; 0 where the link is odd.
  std::array<std::vector<float>, kUp> stiffness;
  std::vector<OddLink> odd;            ///< each odd link once from each of its ends, by rising node, then direction
  std::vector<std::size_t> first_odd;  ///< by block: its first odd link; and one entry more
  /// By odd link: its matrix, which the sweep Matrices writes. Those of other links are in SpringArrays.
  std::vector<SpringMatrix<float>> odd_matrix;

  explicit SpringGrid(const Model& model);
  /// Spring constants by node.
  const float* constants(std::size_t up) const { return stiffness[up].data() + padding; }
};

/// Nodes of a block, from `begin` up to but not including `end`.
struct NodeRange {
  std::size_t begin, end;
};

// What sweeps (spring_sweeps.h) do for the nodes of a block, with vectors. They read the springs from a grid in place
// of the table of neighbours, and make every sum of a node in the same order.

void sweep(SpringGrid& grid, NodeRange range, const sweeps::Matrices& matrices);
void sweep(const SpringGrid& grid, NodeRange range, const sweeps::Inverses& inverses);
void sweep(const SpringGrid& grid, NodeRange range, const sweeps::PlacedForces& forces);
/// @param sums  by node, from the first of the range on: what the sweep returns
void sweep(const SpringGrid& grid, NodeRange range, const sweeps::Bend& bend, Products* sums);
void sweep(const SpringGrid& grid, NodeRange range, const sweeps::StrainOf& strain, Sums* sums);
void sweep(const SpringGrid& grid, NodeRange range, const sweeps::Descend& descend);

}  // namespace tetwarp::simulate
