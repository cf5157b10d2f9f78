// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "deform/simulate/spring_step.h"

namespace tetwarp::simulate {

/// One number a node with zeros before and after, so that neighbours at a fixed distance may be read without asking
/// whether they exist.
template <class T>
class Padded {
 public:
  Padded() = default;
  Padded(std::size_t nodes, std::size_t padding) : padding_(padding), values_(nodes + 2 * padding, T(0)) {}
  T* data() { return values_.data() + padding_; }
  const T* data() const { return values_.data() + padding_; }
  T& operator[](std::size_t n) { return data()[n]; }
  const T& operator[](std::size_t n) const { return data()[n]; }

 private:
  std::size_t padding_ = 0;
  std::vector<T> values_;
};

/// A vector a node.
template <class T>
using PaddedVectors = std::array<Padded<T>, 3>;

/// A link that does not lead to the next vertex on the lattice, because a cut gave one of its ends a copy.
struct OddLink {
  std::uint32_t node, other;
  int direction;
  float stiffness;
};

/// Springs of a model as the CPU sweeps over them: those between vertices at fixed distances, without a table of
/// neighbours, and a list of the few others.
struct SpringGrid {
  /// Nodes that one task sweeps over; sums go block by block, so that threads do not change them.
  static constexpr std::size_t kBlock = 1024;
  static constexpr std::size_t kLanes = 32;  ///< sweeps may go on for so many nodes after the last

  std::size_t nodes = 0, padding = 0;
  std::array<std::ptrdiff_t, kUp> distance{};        ///< to the neighbour in direction kUp + d
  std::array<RestLink<double>, kDirections> rest{};  ///< of each direction
  std::array<Padded<float>, kUp> stiffness;          ///< of the link in direction kUp + d; 0 where it is odd
  std::vector<OddLink> odd;                          ///< from each of their ends, by rising node
  std::vector<std::size_t> first_odd;                ///< of each block, and one more

  explicit SpringGrid(const Model& model);
  std::size_t blocks() const { return (nodes + kBlock - 1) / kBlock; }
  template <class T>
  PaddedVectors<T> vectors() const {
    const Padded<T> one(nodes, padding);
    return {one, one, one};
  }
};

/// Nodes begin to end of a grid: a block.
struct NodeRange {
  std::size_t begin, end;
};

/// Spring matrices of regular links up, and of odd ones.
struct SpringMatrices {
  std::array<std::array<Padded<float>, 4>, kUp> up;  ///< across.x, .y, .z and even
  std::vector<SpringMatrix<float>> odd;
};

/// Forces of springs on the nodes of a block. @return half their energies
double sweep_forces(const SpringGrid& grid, NodeRange range, const PaddedVectors<double>& displacement,
                    PaddedVectors<double>& force);
/// Matrices of links from the nodes of a block.
void sweep_matrices(const SpringGrid& grid, NodeRange range, const PaddedVectors<double>& displacement, Stiffness kind,
                    SpringMatrices& matrices);
/// Of each node the sum of matrices times the node's vector less its neighbour's.
void sweep_product(const SpringGrid& grid, NodeRange range, const SpringMatrices& matrices,
                   const PaddedVectors<float>& vector, PaddedVectors<float>& product);

}  // namespace tetwarp::simulate
