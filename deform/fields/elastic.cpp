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

namespace {

/// The 4 x 4 x 4 control points round a place, and what of the sum over them does not depend on x.
class Controls {
 public:
  explicit Controls(std::uint64_t seed) : start_(split_mix(seed)) {}

  /// The sum over the control points. @param t  place, in units of their distance
  glm::dvec3 sum(const glm::dvec3& t) {
    const glm::dvec3 below = glm::floor(t);
    const glm::i64vec3 first = glm::i64vec3(below) - std::int64_t{1};
    const bool same_row = has_ && t.y == at_.y && t.z == at_.z && first.y == first_.y && first.z == first_.z;
    // Planes of control points that the last place had too.
    const std::int64_t shift = has_ && first.y == first_.y && first.z == first_.z ? first.x - first_.x : 4;
    const int kept = shift >= 0 && shift < 4 ? static_cast<int>(4 - shift) : 0;
    if (kept < 4) {
      for (int i = 0; i < kept; ++i) {
        numbers_[i] = numbers_[i + shift];
        planes_[i] = planes_[i + shift];
      }
      for (int i = kept; i < 4; ++i) find_numbers(numbers_[i], first + glm::i64vec3(i, 0, 0));
    }
    if (!same_row || kept < 4) {
      const std::array<double, 4> by_y = spline_weights(t.y - below.y), by_z = spline_weights(t.z - below.z);
      for (int i = same_row ? kept : 0; i < 4; ++i) planes_[i] = plane(numbers_[i], by_y, by_z);
    }
    has_ = true;
    at_ = t;
    first_ = first;
    const std::array<double, 4> by_x = spline_weights(t.x - below.x);
    glm::dvec3 sum(0);
    for (int i = 0; i < 4; ++i) sum += by_x[i] * planes_[i];
    return sum;
  }

 private:
  using Plane = std::array<std::array<glm::dvec3, 4>, 4>;  // by j, k

  /// The numbers of random_control; the part of the hash that control points share is computed once.
  void find_numbers(Plane& numbers, const glm::i64vec3& first) const {
    const std::uint64_t plane_hash = split_mix(start_ + static_cast<std::uint64_t>(first.x));
    for (int j = 0; j < 4; ++j) {
      const std::uint64_t row_hash = split_mix(plane_hash + static_cast<std::uint64_t>(first.y + j));
      for (int k = 0; k < 4; ++k)
        numbers[j][k] = numbers_of(split_mix(row_hash + static_cast<std::uint64_t>(first.z + k)));
    }
  }
  static glm::dvec3 plane(const Plane& numbers, const std::array<double, 4>& by_y, const std::array<double, 4>& by_z) {
    glm::dvec3 plane(0);
    for (int j = 0; j < 4; ++j) {
      glm::dvec3 row(0);
      for (int k = 0; k < 4; ++k) row += by_z[k] * numbers[j][k];
      plane += by_y[j] * row;
    }
    return plane;
  }

  std::uint64_t start_;
  bool has_ = false;
  glm::dvec3 at_{0};
  glm::i64vec3 first_{0};
  std::array<Plane, 4> numbers_;
  std::array<glm::dvec3, 4> planes_;
};

}  // namespace

glm::dvec3 Elastic::operator()(const glm::dvec3& point) const {
  return amplitude * Controls(seed).sum((point - centre) / spacing);
}

void Elastic::of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const {
  Controls controls(seed);
  for (std::size_t n = 0; n < points.size(); ++n) {
    displacement[n] = amplitude * controls.sum((points[n] - centre) / spacing);
  }
}

}  // namespace tetwarp
