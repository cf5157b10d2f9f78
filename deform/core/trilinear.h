// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/ext/vector_int3_sized.hpp>
#include <glm/vec3.hpp>

namespace tetwarp {

/// The cell along one axis that contains a continuous index, of samples 0 to `size` - 1; -1 outside.
inline std::int64_t cell_of(double index, std::int64_t size) {
  if (!(index >= 0 && index <= static_cast<double>(size - 1))) return -1;
  return std::min(static_cast<std::int64_t>(index), std::max<std::int64_t>(size - 2, 0));
}

/// Values between the samples of a grid, trilinear.
/// @tparam Value  double, or a vector of them
/// @param size    samples on each axis
/// @param index   continuous index
/// @param sample  `sample(i64vec3)` gives a sample of the grid; it is asked for those alone whose weight is not 0
/// @return NaN outside of the samples, or where one that is needed is NaN
template <class Value = glm::dvec3, class Sample>
Value trilinear(const glm::i64vec3& size, const glm::dvec3& index, Sample&& sample) {
  glm::i64vec3 cell;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = cell_of(index[axis], size[axis]);
    if (cell[axis] < 0) return Value(NAN);
  }
  const glm::dvec3 t = index - glm::dvec3(cell);
  Value sum(0);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::i64vec3 step(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 part = glm::mix(1.0 - t, t, glm::dvec3(step));
    const double weight = part.x * part.y * part.z;
    if (weight != 0) sum += weight * Value(sample(cell + step));
  }
  return sum;
}

}  // namespace tetwarp
