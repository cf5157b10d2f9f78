// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/geometry.h"

namespace tetwarp::simulate {

constexpr std::uint32_t kCorners = 8;  ///< of a cell

/// Where a corner of a cell lies as seen from the first one, in cells along i, j, k.
inline glm::i64vec3 corner_steps(std::uint32_t c) { return {c & 1, c >> 1 & 1, c >> 2}; }

/// Numbers of vertices and cells of a lattice, i fastest.
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

}  // namespace tetwarp::simulate
