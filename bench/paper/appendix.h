// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bench/paper/inverse.h"

namespace tetwarp::bench {

/// One tetrahedron's determinant in four ways; the 4 x 4 forms by minors of differences (`determinant_4x4`).
struct Determinants {
  double double_4x4 = 0, double_3x3 = 0;
  float float_4x4 = 0, float_3x3 = 0;
};

/// @param corners  exact in float
Determinants determinants(const Corners<float>& corners);

/// In which order the products of the paper's Appendix A are formed and summed.
enum class Order : std::uint8_t {
  as_printed,     ///< (r s) t, terms and cofactors summed from the left, every operation rounded
  right_to_left,  ///< r (s t)
  ends_first,     ///< (r t) s
  fused_last,  ///< as printed, but the first of the four cofactors' products is fused with the second, n11 t11 + (n21
               ///< t12)
  fused        ///< as printed, but every product after the first of a sum is fused with that sum
};

/// What the paper's Appendix A computes.
template <class Real>
struct AppendixResult {
  Real determinant = 0;
  std::array<Real, 4> inverse{};  ///< the first column: what the coordinates of A, B, C, D gain with x
};

/// The determinant of the 4 x 4 matrix of Eq. 6 and the first column of its inverse, expanded along the first column by
/// cofactors of six products of three, as the paper prints them.
AppendixResult<double> expand_by_cofactors(const Corners<double>& corners, Order order);
AppendixResult<float> expand_by_cofactors(const Corners<float>& corners, Order order);

/// The determinant of the paper's Eq. 8 in one way, beside what the paper prints for it.
struct DeterminantForm {
  std::string name;
  double value = 0;
  std::optional<double> printed = {};
};

/// Relative errors of the float forms against 3 x 3 in double, over random tetrahedra of about one cell.
struct DeterminantErrors {
  double distance = 0;  ///< their coordinates lie within a tenth below it, on all three axes
  std::int64_t tetrahedra = 0;
  double largest_4x4 = 0, median_4x4 = 0, largest_3x3 = 0, median_3x3 = 0;
};

/// What the paper's Appendix A is about: the determinant of Eq. 6 in float far from the origin, and of Eq. 13. The
/// example is the paper's own (`published_appendix`).
struct Appendix {
  std::vector<DeterminantForm> forms;
  AppendixResult<double> in_double;  ///< in the printed order
  AppendixResult<float> in_float;
  std::vector<DeterminantErrors> errors;
};

/// The same numbers on every call.
Appendix measure_appendix(std::int64_t tetrahedra = 100000);

}  // namespace tetwarp::bench
