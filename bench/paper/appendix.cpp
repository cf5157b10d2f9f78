// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/appendix.h"

#include <cmath>
#include <random>

namespace tetwarp::bench {

namespace {

template <class To, class From>
Corners<To> cast(const Corners<From>& t) {
  const auto point = [](const Point<From>& p) {
    return Point<To>{static_cast<To>(p.x), static_cast<To>(p.y), static_cast<To>(p.z)};
  };
  return {point(t.a), point(t.b), point(t.c), point(t.d)};
}

/// Products of three, and how they are summed.
template <class Real>
class Sum {
 public:
  explicit Sum(Order order) : order_(order) {}

  /// Adds sign (r s) t.
  void add(Real sign, Real r, Real s, Real t) {
    switch (order_) {
      case Order::right_to_left: return add(r, sign * (s * t));
      case Order::ends_first: return add(sign * (r * t), s);
      default: return add(sign * (r * s), t);
    }
  }
  Real value() const { return sum_; }

 private:
  void add(Real a, Real b) {
    sum_ = first_ ? a * b : (order_ == Order::fused ? std::fma(a, b, sum_) : sum_ + a * b);
    first_ = false;
  }

  Order order_;
  Real sum_ = 0;
  bool first_ = true;
};

/// The determinant of rows a, b, c and columns p, q, r, terms in the paper's order: its t11 is that of rows and columns
/// 2, 3, 4. Of t12 and t14 the paper writes the first two terms the other way round, which changes no bit.
template <class Real>
Real minor_of(const Real (&n)[4][4], Order order, const int (&rows)[3], const int (&columns)[3]) {
  const auto& [a, b, c] = rows;
  const auto& [p, q, r] = columns;
  Sum<Real> sum(order);
  sum.add(1, n[a][q], n[b][r], n[c][p]);
  sum.add(-1, n[a][r], n[b][q], n[c][p]);
  sum.add(1, n[a][r], n[b][p], n[c][q]);
  sum.add(-1, n[a][p], n[b][r], n[c][q]);
  sum.add(-1, n[a][q], n[b][p], n[c][r]);
  sum.add(1, n[a][p], n[b][q], n[c][r]);
  return sum.value();
}

constexpr int kOthers[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};

/// Uniform in [low, high), from the bits of the generator alone: distributions differ between standard libraries.
float uniform(std::mt19937_64& random, double low, double high) {
  return static_cast<float>(low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53);
}

/// D anywhere, A, B, C a cell further along i, j, k, each corner moved by up to a quarter of a cell.
Corners<float> random_tetrahedron(std::mt19937_64& random, double distance) {
  const auto corner = [&](const Point<float>& d, int axis) {
    const auto along = [&](int n) { return uniform(random, -0.25, 0.25) + (n == axis ? 1.0f : 0.0f); };
    const float x = along(0), y = along(1), z = along(2);
    return Point<float>{d.x + x, d.y + y, d.z + z};
  };
  const double least = 0.9 * distance;
  const float x = uniform(random, least, distance), y = uniform(random, least, distance),
              z = uniform(random, least, distance);
  const Point<float> d{x, y, z};
  const Point<float> a = corner(d, 0), b = corner(d, 1), c = corner(d, 2);
  return {a, b, c, d};
}

Json measure_errors(double distance, std::int64_t tetrahedra) {
  std::mt19937_64 random(1);
  std::vector<double> of_4x4, of_3x3;
  for (std::int64_t n = 0; n < tetrahedra; ++n) {
    const Determinants found = determinants(random_tetrahedron(random, distance));
    const double exact = found.double_3x3;
    of_4x4.push_back(std::abs((static_cast<double>(found.float_4x4) - exact) / exact));
    of_3x3.push_back(std::abs((static_cast<double>(found.float_3x3) - exact) / exact));
  }
  const auto largest_and_median = [](std::vector<double> errors) {
    const Json summary = summarize(std::move(errors));
    return Json{{"largest", summary["max"]}, {"median", summary["median"]}};
  };
  return {{"distance", distance},
          {"tetrahedra", tetrahedra},
          {"float_4x4", largest_and_median(std::move(of_4x4))},
          {"float_3x3", largest_and_median(std::move(of_3x3))}};
}

Json all_forms() {
  const Corners<float> narrow = cast<float>(kEquation8);
  Json forms = Json::array();
  const auto add = [&](const char* name, double value, const Json& printed) {
    forms.push_back({{"form", name}, {"determinant", value}, {"printed", printed}});
  };
  const auto add_float = [&](const char* name, Order order) {
    add(name, static_cast<double>(expand_by_cofactors(narrow, order).determinant), kPrintedInFloat.determinant);
  };
  add("4 x 4, Eq. 6, double, as printed: (r s) t, summed from the left",
      expand_by_cofactors(kEquation8, Order::as_printed).determinant, kPrintedInDouble.determinant);
  add_float("4 x 4, Eq. 6, float, as printed", Order::as_printed);
  add_float("the same, products r (s t)", Order::right_to_left);
  add_float("the same, products (r t) s", Order::ends_first);
  add_float("as printed, the first of the four last products fused with the second", Order::fused_last);
  add_float("as printed, every product fused with its sum", Order::fused);
  add("4 x 4, Eq. 6, float, minors of differences", static_cast<double>(determinant_4x4(narrow)), nullptr);
  add("3 x 3 about D, Eq. 13, double", determinant_about_d(kEquation8), nullptr);
  add("3 x 3 about D, Eq. 13, float", static_cast<double>(determinant_about_d(narrow)), nullptr);
  return forms;
}

}  // namespace

template <class Real>
AppendixResult<Real> expand_by_cofactors(const Corners<Real>& corners, Order order) {
  const auto& [a, b, c, d] = corners;
  const Real m[4][4] = {{a.x, b.x, c.x, d.x}, {a.y, b.y, c.y, d.y}, {a.z, b.z, c.z, d.z}, {1, 1, 1, 1}};
  Real of_column[4], of_row[4];  // cofactors, the paper's t11 to t14 first
  for (int n = 0; n < 4; ++n) {
    const Real sign = n % 2 == 0 ? Real(1) : Real(-1);
    of_column[n] = sign * minor_of(m, order, kOthers[n], kOthers[0]);
    of_row[n] = sign * minor_of(m, order, kOthers[0], kOthers[n]);
  }
  const auto term = [&](int n) { return m[n][0] * of_column[n]; };
  AppendixResult<Real> result;
  if (order == Order::fused_last) {
    result.determinant = std::fma(m[0][0], of_column[0], term(1)) + term(2) + term(3);
  } else {
    result.determinant = term(0);
    for (int n = 1; n < 4; ++n) {
      result.determinant =
          order == Order::fused ? std::fma(m[n][0], of_column[n], result.determinant) : result.determinant + term(n);
    }
  }
  for (std::size_t n = 0; n < 4; ++n) result.inverse[n] = of_row[n] / result.determinant;
  return result;
}

template AppendixResult<double> expand_by_cofactors(const Corners<double>&, Order);
template AppendixResult<float> expand_by_cofactors(const Corners<float>&, Order);

Determinants determinants(const Corners<float>& corners) {
  const Corners<double> wide = cast<double>(corners);
  return {determinant_4x4(wide), determinant_about_d(wide), determinant_4x4(corners), determinant_about_d(corners)};
}

Json measure_appendix(std::int64_t tetrahedra) {
  const auto point = [](const Point<double>& p) { return Json{p.x, p.y, p.z}; };
  const auto& [a, b, c, d] = kEquation8;
  Json errors = Json::array();
  for (const double distance : {32.0, 128.0, 512.0, 1024.0}) errors.push_back(measure_errors(distance, tetrahedra));
  return {{"corners", {{"A", point(a)}, {"B", point(b)}, {"C", point(c)}, {"D", point(d)}}},
          {"determinants", all_forms()},
          {"inverse_first_column",
           {{"double", expand_by_cofactors(kEquation8, Order::as_printed).inverse},
            {"float", expand_by_cofactors(cast<float>(kEquation8), Order::as_printed).inverse},
            {"printed_double", kPrintedInDouble.inverse},
            {"printed_float", kPrintedInFloat.inverse}}},
          {"relative_errors", errors}};
}

}  // namespace tetwarp::bench
