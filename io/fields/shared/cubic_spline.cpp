// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/shared/cubic_spline.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tetwarp {
namespace {

/// The four control points on one axis that have weight at an index, and their weights.
struct Support {
  std::array<std::int64_t, 4> at{};
  std::array<double, 4> weight{};
};

Support support_of(double index, std::int64_t size, CubicSpline::Beyond beyond) {
  const auto last = static_cast<double>(size - 1), base = std::floor(index), t = index - base, s = 1 - t;
  Support result;
  result.weight = {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6,
                   t * t * t / 6};
  for (std::size_t n = 0; n < 4; ++n) {
    const double wanted = base - 1 + static_cast<double>(n), taken = std::clamp(wanted, 0.0, last);
    result.at[n] = static_cast<std::int64_t>(taken);
    if (beyond == CubicSpline::Beyond::zero && taken != wanted) result.weight[n] = 0;
  }
  return result;
}

}  // namespace

glm::dvec3 CubicSpline::at(const glm::dvec3& index) const {
  const Support x = support_of(index.x, size.x, beyond), y = support_of(index.y, size.y, beyond),
                z = support_of(index.z, size.z, beyond);
  glm::dvec3 sum(0);
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t b = 0; b < 4; ++b) {
      const std::int64_t row = size.x * (y.at[b] + size.y * z.at[c]);
      for (std::size_t a = 0; a < 4; ++a)
        sum += x.weight[a] * y.weight[b] * z.weight[c] * control[static_cast<std::size_t>(row + x.at[a])];
    }
  }
  return sum;
}

}  // namespace tetwarp
