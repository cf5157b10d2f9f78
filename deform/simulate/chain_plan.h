// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <span>
#include <vector>

#include "deform/simulate/chain_step.h"
#include "deform/simulate/simulation.h"

namespace tetwarp::simulate {

/// The nodes of a box of vertices, with consecutive numbers.
struct ChainBlock {
  std::int32_t begin = 0, end = 0;
  int colour = 0;                    ///< blocks of one colour share no link
  std::vector<std::int32_t> beside;  ///< blocks that share links with this one
};

/// Placed nodes that go the same way: `placed[begin]` up to, not with, `placed[end]`.
struct PlacedSet {
  std::size_t begin, end;
};

/// A model made ready for ChainMail on any backend.
///
/// Nodes are numbered block by block, and within a block as in the model. A block is a few rows of vertices, on the
/// chequered pattern of `colour`, with the copies of its vertices. The result does not depend on the numbers.
class ChainPlan {
 public:
  /// @throws InputError for a lattice that is not orthonormal, or limits that do not include 0
  explicit ChainPlan(const Model& model);

  /// A view of the plan in host memory.
  /// @param moves  one for each node, see ChainView::moves
  ChainView view(const std::uint8_t* moves) const {
    return {nodes(), around.data(), links.data(), shares.data(), moves};
  }
  std::int32_t nodes() const { return static_cast<std::int32_t>(node_of.size()); }

  /// A vector in LPS mm as units. @throws InputError where it is not finite or too long; the message names it by `what`
  /// and by the node's number in the model
  Units to_units(const glm::vec3& lps, const char* what, std::size_t node) const;
  std::vector<Units> to_units(std::span<const glm::vec3> displacement) const;

  /// The placed nodes with their goals; the backend fills in where they start. @throws InputError for loads that
  /// `set_loads` refuses
  std::vector<PlacedNode> read(const Loads& loads) const;
  /// Puts placed nodes, with their starts, in the order of the sets that go the same way. No sets where they are more
  /// than SetPaths has, as those of a handle that turns, or where their paths would take too much memory.
  std::vector<PlacedSet> sets_of(std::vector<PlacedNode>& placed) const;
  /// Whether links lead from a node to a placed one.
  std::vector<std::uint8_t> moving(std::span<const PlacedNode> placed) const;

  std::vector<std::int32_t> node_of;    ///< by node of the plan: its number in the model
  std::vector<std::int32_t> number_of;  ///< by node of the model: its number in the plan
  std::vector<ChainBlock> blocks;
  std::vector<std::int32_t> around;  ///< neighbours, see ChainView::around
  std::vector<LinkUnits> links;      ///< limits, see ChainView::links
  /// At 3 * (n_i + 3 n_j + 9 n_k) + axis, for n_i, n_j, n_k links along the axes: the weight of a neighbour on an axis
  /// in the mean, 2^-16. Weights are as one over the squared length of a link, so that what the mean leads to does not
  /// depend on the shape of cells.
  std::vector<std::int32_t> shares;
  /// Parameters of the Pacer.
  std::int32_t momentum = 0, patience = 1;
  glm::dmat3 direction{1};

 private:
  void number(const Model& model);
  void connect(const Model& model);
  void find_islands();
  void weigh(const Geometry& lattice);

  std::vector<std::int32_t> island_;  ///< by node: its island, a set of nodes that links connect
  std::int32_t islands_ = 0;
};

/// `Simulation::state` of ChainMail: where nodes are, where they are shown, and that in mm.
std::vector<std::byte> state_of_chain(std::span<const Units> now, std::span<const Units> shown,
                                      std::span<const glm::vec3> displacement);
/// Reads it again into arrays of the same sizes. @throws InputError for a state of another size
void read_chain_state(std::span<const std::byte> state, std::span<Units> now, std::span<Units> shown,
                      std::span<glm::vec3> displacement);

/// Checks the arguments of `advance`. @throws InputError unless the part is from 0 to 1 and the rule's numbers are not
/// negative
void require_valid(double part, const StoppingRule& rule);

/// The length in mm of a motion whose `square_of_motion` this is.
double motion_mm(std::uint64_t square);

}  // namespace tetwarp::simulate
