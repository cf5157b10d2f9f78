// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "deform/simulate/spring_step.h"

namespace tetwarp::simulate {

/// One number a node, with zeros before the first and after the last, so that neighbours at a fixed distance may be
/// read whether or not they exist.
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

/// One vector a node, its components apart.
template <class T>
using PaddedVectors = std::array<Padded<T>, 3>;

/// A link that does not lead to the next vertex of the lattice, because a cut gave one of its ends a copy.
struct OddLink {
  std::uint32_t node, other;
  int direction;
  float stiffness;
};

/// Springs of a model in the form over which the CPU sweeps: those between vertices at fixed distances, without a table
/// of neighbours, and a list of the few others.
struct SpringGrid {
  /// Nodes that one task sweeps over. Sums are made block by block, so that they do not depend on threads.
  static constexpr std::size_t kBlock = 1024;
  /// Sweeps may read and write up to so many nodes after the last.
  static constexpr std::size_t kLanes = 32;

  std::size_t nodes = 0, padding = 0;
  std::array<std::ptrdiff_t, kUp> distance{};  ///< by direction kUp + d: distance of a node's neighbour in the arrays
  std::array<RestLink<double>, kDirections> rest{};  ///< by direction
  /// By direction kUp + d: spring constant of the link, N/mm; 0 where the link is odd.
  std::array<Padded<float>, kUp> stiffness;
  std::vector<OddLink> odd;            ///< each odd link once from each of its ends, by rising node
  std::vector<std::size_t> first_odd;  ///< by block: its first odd link; and one entry more

  explicit SpringGrid(const Model& model);
  std::size_t blocks() const { return (nodes + kBlock - 1) / kBlock; }
  template <class T>
  PaddedVectors<T> vectors() const {
    const Padded<T> one(nodes, padding);
    return {one, one, one};
  }
};

/// Nodes of a block, from `begin` up to but not including `end`.
struct NodeRange {
  std::size_t begin, end;
};

/// Spring matrices of the regular links upwards, and of the odd ones.
struct SpringMatrices {
  std::array<std::array<Padded<float>, 4>, kUp> up;  ///< across.x, across.y, across.z and even
  std::vector<SpringMatrix<float>> odd;
};

/// Computes the forces of springs on the nodes of a block. @return half the energy of these springs
double sweep_forces(const SpringGrid& grid, NodeRange range, const PaddedVectors<double>& displacement,
                    PaddedVectors<double>& force);
/// Computes the matrices of the links from the nodes of a block.
void sweep_matrices(const SpringGrid& grid, NodeRange range, const PaddedVectors<double>& displacement, Stiffness kind,
                    SpringMatrices& matrices);
/// Computes, for each node of a block, the sum over its links of the link's matrix times the node's vector minus the
/// neighbour's.
void sweep_product(const SpringGrid& grid, NodeRange range, const SpringMatrices& matrices,
                   const PaddedVectors<float>& vector, PaddedVectors<float>& product);

}  // namespace tetwarp::simulate
