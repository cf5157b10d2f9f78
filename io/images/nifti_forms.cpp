// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/nifti_forms.h"

#include <algorithm>
#include <cmath>

namespace tetwarp {
namespace {

/// A 3 x 3 matrix by rows. Values are float32, as in niftilib; sums and products are in double where niftilib has them
/// in double.
using Matrix = std::array<std::array<float, 3>, 3>;

Matrix transposed(const Matrix& m) {
  Matrix t;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) t[i][j] = m[j][i];
  return t;
}

double determinant(const Matrix& m) {
  const auto at = [&](std::size_t i, std::size_t j) { return static_cast<double>(m[i][j]); };
  return at(0, 0) * at(1, 1) * at(2, 2) - at(0, 0) * at(2, 1) * at(1, 2) - at(1, 0) * at(0, 1) * at(2, 2) +
         at(1, 0) * at(2, 1) * at(0, 2) + at(2, 0) * at(0, 1) * at(1, 2) - at(2, 0) * at(1, 1) * at(0, 2);
}

Matrix inverse(const Matrix& m) {
  const double by = 1 / determinant(m);
  const auto at = [&](std::size_t i, std::size_t j) { return static_cast<double>(m[i % 3][j % 3]); };
  Matrix result;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double minor = at(j + 1, i + 1) * at(j + 2, i + 2) - at(j + 1, i + 2) * at(j + 2, i + 1);
      result[i][j] = static_cast<float>(by * minor);
    }
  }
  return result;
}

/// The largest sum of the sizes in a row.
float row_norm(const Matrix& m) {
  float largest = 0;
  for (const auto& [a, b, c] : m) {
    const double sum =
        std::abs(static_cast<double>(a)) + std::abs(static_cast<double>(b)) + std::abs(static_cast<double>(c));
    largest = std::max(largest, static_cast<float>(sum));
  }
  return largest;
}

/// The rotation (or mirrored rotation) that is nearest to a matrix which is nearly one: its polar decomposition by
/// Higham's iteration, the mean of a matrix and of its inverse transposed, again and again. Far from the end both are
/// scaled to the same size.
Matrix nearest_rotation(Matrix x) {
  constexpr int kMostSteps = 101;
  float difference = 1;
  for (int step = 0; step < kMostSteps; ++step) {
    const Matrix y = transposed(inverse(x));
    float of_x = 1, of_y = 1;
    if (static_cast<double>(difference) > 0.3) {
      const auto size = [](const Matrix& m) {
        return static_cast<float>(std::sqrt(static_cast<double>(row_norm(m) * row_norm(transposed(m)))));
      };
      of_x = static_cast<float>(std::sqrt(static_cast<double>(size(y) / size(x))));
      of_y = static_cast<float>(1.0 / static_cast<double>(of_x));
    }
    double changed = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        const float before = x[i][j];
        x[i][j] = static_cast<float>(0.5 * static_cast<double>(of_x * x[i][j] + of_y * y[i][j]));
        changed += std::abs(static_cast<double>(x[i][j] - before));
      }
    }
    difference = static_cast<float>(changed);
    if (static_cast<double>(difference) < 3e-6) break;
  }
  return x;
}

/// The matrix with each row divided by its length.
Matrix normalised(Matrix m) {
  for (auto& [a, b, c] : m) {
    const auto by = static_cast<float>(1 / std::sqrt(static_cast<double>(a * a + b * b + c * c)));
    a *= by;
    b *= by;
    c *= by;
  }
  return m;
}

/// b, c and d of the unit quaternion of a rotation, of which a is not negative.
std::array<float, 3> quaternion(const Matrix& rotation, float qfac) {
  const auto at = [&](std::size_t i, std::size_t j) {
    return static_cast<double>(rotation[i][j]) * (j == 2 ? static_cast<double>(qfac) : 1.0);
  };
  double a = at(0, 0) + at(1, 1) + at(2, 2) + 1, b = 0, c = 0, d = 0;
  if (a > 0.5) {
    a = 0.5 * std::sqrt(a);
    b = 0.25 * (at(2, 1) - at(1, 2)) / a;
    c = 0.25 * (at(0, 2) - at(2, 0)) / a;
    d = 0.25 * (at(1, 0) - at(0, 1)) / a;
  } else {  // the largest of b, c and d is not near 0, and is divided by
    const double bb = 1 + at(0, 0) - (at(1, 1) + at(2, 2)), cc = 1 + at(1, 1) - (at(0, 0) + at(2, 2)),
                 dd = 1 + at(2, 2) - (at(0, 0) + at(1, 1));  // four times the squares
    if (bb > 1) {
      b = 0.5 * std::sqrt(bb);
      c = 0.25 * (at(0, 1) + at(1, 0)) / b;
      d = 0.25 * (at(0, 2) + at(2, 0)) / b;
      a = 0.25 * (at(2, 1) - at(1, 2)) / b;
    } else if (cc > 1) {
      c = 0.5 * std::sqrt(cc);
      b = 0.25 * (at(0, 1) + at(1, 0)) / c;
      d = 0.25 * (at(1, 2) + at(2, 1)) / c;
      a = 0.25 * (at(0, 2) - at(2, 0)) / c;
    } else {
      d = 0.5 * std::sqrt(dd);
      b = 0.25 * (at(0, 2) + at(2, 0)) / d;
      c = 0.25 * (at(1, 2) + at(2, 1)) / d;
      a = 0.25 * (at(1, 0) - at(0, 1)) / d;
    }
    if (a < 0) {
      b = -b;
      c = -c;
      d = -d;
    }
  }
  return {static_cast<float>(b), static_cast<float>(c), static_cast<float>(d)};
}

}  // namespace

NiftiForms nifti_forms(const Geometry& grid) {
  constexpr std::array<double, 3> kRas = {-1, -1, 1};
  Matrix axes;  // a row an axis of the grid
  NiftiForms forms;
  for (std::size_t row = 0; row < 3; ++row) {
    const int r = static_cast<int>(row);
    for (std::size_t axis = 0; axis < 3; ++axis)
      axes[axis][row] = static_cast<float>(kRas[row] * grid.direction[static_cast<int>(axis)][r]);
    forms.offset[row] = static_cast<float>(kRas[row] * grid.origin[r]);
  }
  const Matrix columns = transposed(nearest_rotation(normalised(axes)));
  // What is nearest to the columns, each by its length: their own lengths are 1 within rounding.
  std::array<double, 3> lengths{};
  for (std::size_t j = 0; j < 3; ++j) {
    const double x = columns[0][j], y = columns[1][j], z = columns[2][j];
    lengths[j] = std::sqrt(x * x + y * y + z * z);
  }
  Matrix unit = columns;
  for (auto& row : unit)
    for (std::size_t j = 0; j < 3; ++j) row[j] = static_cast<float>(static_cast<double>(row[j]) / lengths[j]);
  const Matrix rotation = nearest_rotation(unit);
  forms.qfac = determinant(rotation) > 0 ? 1.0f : -1.0f;
  forms.quatern = quaternion(rotation, forms.qfac);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      forms.srow[row][axis] = static_cast<float>(grid.spacing[static_cast<int>(axis)]) * columns[row][axis];
    forms.srow[row][3] = forms.offset[row];
  }
  return forms;
}

}  // namespace tetwarp
