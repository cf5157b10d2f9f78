// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/elastic.h"

#include <array>
#include <cmath>
#include <glm/common.hpp>

namespace tetwarp {

std::uint64_t split_mix(std::uint64_t state) {
  std::uint64_t z = state + 0x9e3779b97f4a7c15;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
  z = (z ^ z >> 27) * 0x94d049bb133111eb;
  return z ^ z >> 31;
}

namespace {

/// Weights of the control points floor(t) - 1 to floor(t) + 2, where f = t - floor(t).
std::array<double, 4> spline_weights(double f) {
  const double g = 1 - f, f2 = f * f, g2 = g * g;
  return {g2 * g / 6, (4 - 6 * f2 + 3 * f2 * f) / 6, (4 - 6 * g2 + 3 * g2 * g) / 6, f2 * f / 6};
}

glm::dvec3 numbers_of(std::uint64_t hash) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << 21) - 1;
  constexpr double kHalfRange = 1 << 20;
  const auto number = [&](int shift) { return (static_cast<double>(hash >> shift & kMask) + 0.5) / kHalfRange - 1; };
  return {number(0), number(21), number(42)};
}

}  // namespace

glm::dvec3 random_control(std::uint64_t seed, const glm::i64vec3& index) {
  std::uint64_t hash = split_mix(seed);
  for (int axis = 0; axis < 3; ++axis) hash = split_mix(hash + static_cast<std::uint64_t>(index[axis]));
  return numbers_of(hash);
}

glm::dvec3 Elastic::operator()(const glm::dvec3& point) const {
  const glm::dvec3 t = (point - centre) / spacing, below = glm::floor(t);
  const glm::i64vec3 first = glm::i64vec3(below) - std::int64_t{1};
  std::array<std::array<double, 4>, 3> weights;
  for (int axis = 0; axis < 3; ++axis) weights[axis] = spline_weights(t[axis] - below[axis]);
  // The numbers of random_control; the part of the hash that control points share is computed once.
  const std::uint64_t start = split_mix(seed);
  glm::dvec3 sum(0);
  for (int i = 0; i < 4; ++i) {
    const std::uint64_t plane_hash = split_mix(start + static_cast<std::uint64_t>(first.x + i));
    glm::dvec3 plane(0);
    for (int j = 0; j < 4; ++j) {
      const std::uint64_t row_hash = split_mix(plane_hash + static_cast<std::uint64_t>(first.y + j));
      glm::dvec3 row(0);
      for (int k = 0; k < 4; ++k)
        row += weights[2][k] * numbers_of(split_mix(row_hash + static_cast<std::uint64_t>(first.z + k)));
      plane += weights[1][j] * row;
    }
    sum += weights[0][i] * plane;
  }
  return amplitude * sum;
}

}  // namespace tetwarp
