// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/contours/zero_contours.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace tetwarp {

namespace {

/// The edges between neighbouring samples of a grid, and which crossing with the border follows which. The grid has an
/// additional frame of unknown samples, so that all contours are closed.
class Squares {
 public:
  Squares(std::span<const double> values, std::int64_t columns, std::int64_t rows)
      : values_(values),
        columns_(columns),
        rows_(rows),
        next_(static_cast<std::size_t>(2 * (columns + 2) * (rows + 2)), kNone) {}

  ZeroContours trace() {
    for (std::int64_t j = -1; j < rows_; ++j)
      for (std::int64_t i = -1; i < columns_; ++i) link(i, j);
    ZeroContours result;
    for (std::size_t first = 0; first < next_.size(); ++first) {
      if (next_[first] == kNone) continue;
      Ring& ring = result.rings.emplace_back();
      for (std::size_t at = first; next_[at] != kNone;) {
        const glm::dvec2 crossing = place(at);
        if (ring.empty() || ring.back() != crossing) ring.push_back(crossing);
        at = std::exchange(next_[at], kNone);
      }
      if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
    }
    result.cut = cut_;
    return result;
  }

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

  double value(std::int64_t i, std::int64_t j) const {
    if (i < 0 || j < 0 || i >= columns_ || j >= rows_) return std::numeric_limits<double>::quiet_NaN();
    return values_[static_cast<std::size_t>(j * columns_ + i)];
  }

  /// Number of the edge from sample (i, j) to the next sample along i, or, if `upwards`, along j.
  std::size_t edge(std::int64_t i, std::int64_t j, bool upwards) const {
    return static_cast<std::size_t>(2 * ((j + 1) * (columns_ + 2) + i + 1)) + (upwards ? 1 : 0);
  }

  glm::dvec2 place(std::size_t edge) {
    const auto sample = static_cast<std::int64_t>(edge / 2);
    const std::int64_t i = sample % (columns_ + 2) - 1, j = sample / (columns_ + 2) - 1;
    const bool upwards = edge % 2 != 0;
    const double a = value(i, j), b = upwards ? value(i, j + 1) : value(i + 1, j);
    const bool known = !std::isnan(a) && !std::isnan(b);
    if (!known) cut_ = true;
    const double t = known ? a / (a - b) : 0.5;
    return glm::dvec2(i, j) + (upwards ? glm::dvec2(0, t) : glm::dvec2(t, 0));
  }

  /// Joins the crossings on the sides of the square at sample (i, j), so that what is inside lies on the left of the
  /// line. A line goes from the side on which a walk counterclockwise round the square leaves the inside, to the side
  /// on which the walk entered it.
  void link(std::int64_t i, std::int64_t j) {
    const std::array<double, 4> corners{value(i, j), value(i + 1, j), value(i + 1, j + 1), value(i, j + 1)};
    std::array<bool, 4> inside{};
    int count = 0;
    for (std::size_t n = 0; n < 4; ++n) count += inside[n] = corners[n] >= 0;
    if (count == 0 || count == 4) return;
    const std::array<std::size_t, 4> sides{edge(i, j, false), edge(i + 1, j, true), edge(i, j + 1, false),
                                           edge(i, j, true)};
    const bool joined = count == 2 && inside[0] == inside[2] &&
                        corners[0] + corners[1] + corners[2] + corners[3] >= 0;  // false where a corner is unknown
    for (std::size_t n = 0; n < 4; ++n) {
      if (!inside[n] || inside[(n + 1) % 4]) continue;
      std::size_t to = n;
      do to = (to + (joined ? 1 : 3)) % 4;
      while (inside[to] || !inside[(to + 1) % 4]);
      next_[sides[n]] = sides[to];
    }
  }

  std::span<const double> values_;
  std::int64_t columns_, rows_;
  std::vector<std::size_t> next_;
  bool cut_ = false;
};

}  // namespace

ZeroContours zero_contours(std::span<const double> values, std::int64_t columns, std::int64_t rows) {
  return Squares(values, columns, rows).trace();
}

}  // namespace tetwarp
