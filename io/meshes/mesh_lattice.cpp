// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/mesh_lattice.h"

#include <cmath>

#include "deform/errors.h"

namespace tetwarp {

std::vector<double> mesh_lattice_numbers(const Geometry& lattice) {
  std::vector<double> numbers;
  const auto add = [&](const glm::dvec3& v) {
    for (int axis = 0; axis < 3; ++axis) numbers.push_back(v[axis]);
  };
  add(glm::dvec3(lattice.size));
  add(lattice.spacing);
  add(lattice.origin);
  for (int column = 0; column < 3; ++column) add(lattice.direction[column]);
  return numbers;
}

Geometry mesh_lattice_of(const std::vector<double>& numbers, const std::string& file) {
  constexpr double kMost = 1 << 18;  // the most vertices on an axis
  require(numbers.size() == kMeshLatticeNumbers,
          "a lattice of " + std::to_string(numbers.size()) + " numbers, " + file);
  const auto triple = [&](std::size_t n) { return glm::dvec3(numbers[3 * n], numbers[3 * n + 1], numbers[3 * n + 2]); };
  Geometry lattice;
  for (int axis = 0; axis < 3; ++axis) {
    const double size = triple(0)[axis];
    require(size >= 2 && size <= kMost && size == std::floor(size),
            "a lattice with " + std::to_string(size) + " vertices on axis " + std::to_string(axis) + ", " + file +
                "; expected a whole number from 2 to 262144");
    lattice.size[axis] = static_cast<std::int64_t>(size);
  }
  lattice.spacing = triple(1);
  lattice.origin = triple(2);
  lattice.direction = glm::dmat3(triple(3), triple(4), triple(5));
  require_valid(lattice, "the lattice of " + file);
  return lattice;
}

}  // namespace tetwarp
