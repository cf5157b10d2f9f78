// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/subject.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deform/errors.h"

namespace tetwarp::truth {

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

Subject::Subject(simulate::Patient patient, Roles roles, const Geometry& volume)
    : patient_(std::move(patient)), roles_(std::move(roles)), volume_(volume) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell_size = std::llround(lattice().spacing[axis] / volume.spacing[axis]);
    last_inside_[axis] =
        std::min((volume.size[axis] - 1) / std::max<std::int64_t>(cell_size, 1), lattice().size[axis] - 1);
  }
  for (const auto& [role, labels] : roles_) {
    require(!patient_.vertex_label.empty(), "the role " + role + " needs a label map");
    const std::vector<std::uint8_t> marked = vertices(role);
    require(std::find(marked.begin(), marked.end(), 1) != marked.end(),
            "no vertex of the lattice has a label of the role " + role);
  }
}

std::vector<std::uint8_t> Subject::vertices(const std::string& role) const {
  const std::vector<std::int64_t>& wanted = roles_.at(role);
  std::vector<std::uint8_t> marked;
  marked.reserve(patient_.vertex_label.size());
  for (const std::int64_t label : patient_.vertex_label)
    marked.push_back(std::find(wanted.begin(), wanted.end(), label) != wanted.end());
  return marked;
}

std::vector<std::uint8_t> Subject::table() const {
  constexpr float kMatterHu = -900;
  const glm::i64vec3 size = lattice().size, cells = size - std::int64_t{1};
  // Of each vertex: whether a cell of the body, or of matter that is no body, meets there.
  std::vector<std::uint8_t> body(patient_.vertex_hu.size()), matter(body.size());
  std::size_t cell = 0;
  for (std::int64_t k = 0; k < cells.z; ++k) {
    for (std::int64_t j = 0; j < cells.y; ++j) {
      for (std::int64_t i = 0; i < cells.x; ++i, ++cell) {
        const bool is_body = patient_.body[cell] != 0;
        if (!is_body && patient_.cell_hu[cell] <= kMatterHu) continue;
        for (std::int64_t corner = 0; corner < 8; ++corner) {
          const std::int64_t at = i + (corner & 1) + size.x * (j + (corner >> 1 & 1) + size.y * (k + (corner >> 2)));
          (is_body ? body : matter)[static_cast<std::size_t>(at)] = 1;
        }
      }
    }
  }
  for (std::size_t n = 0; n < matter.size(); ++n) matter[n] = matter[n] && !body[n];
  return matter;
}

std::vector<double> distance_mm(const Geometry& lattice, const std::vector<std::uint8_t>& marked) {
  const glm::i64vec3 size = lattice.size;
  const auto count = static_cast<std::size_t>(voxel_count(lattice));
  require(marked.size() == count, "distances are measured on a lattice with one mark a vertex");
  std::vector<double> squares(count);
  for (std::size_t n = 0; n < count; ++n) squares[n] = marked[n] ? 0 : kNowhere;
  Line line(static_cast<std::size_t>(std::max({size.x, size.y, size.z})));
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto length = static_cast<std::size_t>(size[axis]);
    for (std::size_t n = 0; n < count; ++n)
      if (n / stride % length == 0) line.transform(squares.data() + n, length, stride, lattice.spacing[axis]);
    stride *= length;
  }
  for (double& square : squares) square = std::sqrt(square);
  return squares;
}

}  // namespace tetwarp::truth
