// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/distance_map.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "deform/cpu/arena.h"
#include "deform/errors.h"

namespace tetwarp {

namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();

/// Squared distances along one line: the lower envelope of parabolas.
class Line {
 public:
  explicit Line(std::size_t most) : values_(most), at_(most), from_(most + 1) {}

  /// @param squares  of a line, `stride` apart; replaced
  void transform(double* squares, std::size_t count, std::size_t stride, double step) {
    std::size_t used = 0;
    for (std::size_t n = 0; n < count; ++n) {
      values_[n] = squares[n * stride];
      if (values_[n] == kNowhere) continue;
      double meets = -kNowhere;
      while (used > 0) {
        meets = crossing(at_[used - 1], n, step);
        if (meets > from_[used - 1]) break;
        --used;
      }
      at_[used] = n;
      from_[used] = used == 0 ? -kNowhere : meets;
      ++used;
    }
    if (used == 0) return;
    std::size_t piece = 0;
    for (std::size_t n = 0; n < count; ++n) {
      while (piece + 1 < used && from_[piece + 1] < static_cast<double>(n)) ++piece;
      const double apart = step * (static_cast<double>(n) - static_cast<double>(at_[piece]));
      squares[n * stride] = apart * apart + values_[at_[piece]];
    }
  }

 private:
  /// Where the parabola of sample b begins to lie below that of sample a, in samples.
  double crossing(std::size_t a, std::size_t b, double step) const {
    const auto x = static_cast<double>(a), y = static_cast<double>(b);
    return ((values_[b] - values_[a]) / (step * step) + y * y - x * x) / (2 * (y - x));
  }

  std::vector<double> values_;
  std::vector<std::size_t> at_;
  std::vector<double> from_;
};

}  // namespace

std::vector<double> distance_mm(const Geometry& grid, const std::vector<std::uint8_t>& marked, const Limits& limits) {
  const glm::i64vec3 size = grid.size;
  const auto count = static_cast<std::size_t>(voxel_count(grid));
  require(marked.size() == count, "distances are measured on a grid with one mark a sample");
  std::vector<double> squares(count);
  const std::int64_t area = size.x * size.y;
  const auto stride = [&](int axis) { return static_cast<std::size_t>(axis == 0 ? 1 : axis == 1 ? size.x : area); };
  // Lines along x and y by slice, those along z by row: one task looks at neighbouring lines, whose samples lie beside
  // each other in memory.
  const auto lines = [&](int axis, std::int64_t first, std::int64_t lines_in_task, std::int64_t step) {
    Line line(static_cast<std::size_t>(size[axis]));
    for (std::int64_t n = 0; n < lines_in_task; ++n)
      line.transform(squares.data() + first + n * step, static_cast<std::size_t>(size[axis]), stride(axis),
                     grid.spacing[axis]);
  };
  cpu::Arena arena(limits);
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t k) {
      for (auto n = static_cast<std::size_t>(k * area); n < static_cast<std::size_t>((k + 1) * area); ++n)
        squares[n] = marked[n] ? 0 : kNowhere;
      lines(0, k * area, size.y, size.x);
      lines(1, k * area, size.x, 1);
    });
    tbb::parallel_for(std::int64_t{0}, size.y, [&](std::int64_t j) { lines(2, j * size.x, size.x, 1); });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
      for (std::size_t n = range.begin(); n < range.end(); ++n) squares[n] = std::sqrt(squares[n]);
    });
  });
  return squares;
}

}  // namespace tetwarp
