// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>

#include "bench/harness/results.h"
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
/// cofactors of six products of three, as the paper prints them. @tparam Real  double or float
template <class Real>
AppendixResult<Real> expand_by_cofactors(const Corners<Real>& corners, Order order);

/// Eqs. 8 to 10 and Appendix A as the paper prints them: a tetrahedron far from the origin, the determinant of its 4 x
/// 4 matrix, and the first four numbers of the inverse, which are its first column.
inline constexpr Corners<double> kEquation8{
    {255.9, 256.7, 133.1}, {256.7, 255.9, 133.4}, {256.7, 256.7, 132.3}, {255.9, 255.9, 132.3}};
inline constexpr AppendixResult<double> kPrintedInDouble{1.216, {-0.723684, 0.526316, 0.723684, -0.526316}},
    kPrintedInFloat{2.010187, {-0.437228, 0.318691, 0.437228, -0.318691}};

/// What Appendix A is about: the determinant of Eq. 6 in float far from the origin, and of Eq. 13, in several orders
/// beside what is printed; and relative errors of the float forms against 3 x 3 in double, over random tetrahedra of
/// about one cell whose coordinates lie within a tenth below a distance, on all three axes. The same on every call.
Json measure_appendix(std::int64_t tetrahedra = 100000);

}  // namespace tetwarp::bench
