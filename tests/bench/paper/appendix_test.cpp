// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/appendix.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace tetwarp::bench {
namespace {

constexpr Corners<float> kUnit = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};

TEST(BenchAppendix, AllFormsAgreeOnAUnitTetrahedronAtTheOrigin) {
  const Determinants found = determinants(kUnit);
  EXPECT_EQ(found.double_4x4, 1);
  EXPECT_EQ(found.double_3x3, 1);
  EXPECT_EQ(found.float_4x4, 1);
  EXPECT_EQ(found.float_3x3, 1);
}

TEST(BenchAppendix, SwappingTwoCornersTurnsTheSign) {
  const Determinants found = determinants({kUnit.b, kUnit.a, kUnit.c, kUnit.d});
  EXPECT_EQ(found.double_4x4, -1);
  EXPECT_EQ(found.float_3x3, -1);
}

Corners<float> equation_8_in_float() {
  const Corners<double>& t = kEquation8;
  const auto narrow = [](const Point<double>& p) {
    return Point<float>{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
  };
  return {narrow(t.a), narrow(t.b), narrow(t.c), narrow(t.d)};
}

TEST(BenchAppendix, ThePapersOrderGivesItsDeterminantsOfEquation8) {
  const AppendixResult<double> exact = expand_by_cofactors(kEquation8, Order::as_printed);
  EXPECT_NEAR(exact.determinant, 1.216, 1e-8);
  const AppendixResult<float> found = expand_by_cofactors(equation_8_in_float(), Order::as_printed);
  EXPECT_NEAR(found.determinant, 2.010187, 1e-4);
}

TEST(BenchAppendix, ThePapersOrderGivesTheInverseThatItPrints) {
  const AppendixResult<double> exact = expand_by_cofactors(kEquation8, Order::as_printed);
  const AppendixResult<float> found = expand_by_cofactors(equation_8_in_float(), Order::as_printed);
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_NEAR(exact.inverse[n], kPrintedInDouble.inverse[n], 5.1e-7) << n;
    EXPECT_NEAR(found.inverse[n], kPrintedInFloat.inverse[n], 5e-6) << n;
  }
}

TEST(BenchAppendix, OrdersDifferOnlyInFloat) {
  float least = 10, largest = 0;
  for (const Order order :
       {Order::as_printed, Order::right_to_left, Order::ends_first, Order::fused_last, Order::fused}) {
    EXPECT_NEAR(expand_by_cofactors(kEquation8, order).determinant, 1.216, 1e-8);
    const float found = expand_by_cofactors(equation_8_in_float(), order).determinant;
    least = std::min(least, found);
    largest = std::max(largest, found);
  }
  EXPECT_LT(least, 1.8f);
  EXPECT_GT(largest, 4.0f);
}

TEST(BenchAppendix, CofactorsAndTheFormAboutDAgreeOnGeneralCorners) {
  const Corners<double> t{{3.5, -1.25, 2}, {0.5, 4.75, -1}, {-2.5, 1, 5.25}, {1.5, 0.25, -0.75}};
  const AppendixResult<double> found = expand_by_cofactors(t, Order::as_printed);
  EXPECT_NEAR(found.determinant, determinant_about_d(t), 1e-12);
  const Barycentric<double> here = barycentric_about_d(t, {0, 0, 0}), there = barycentric_about_d(t, {1, 0, 0});
  EXPECT_NEAR(found.inverse[0], there.a - here.a, 1e-12);
  EXPECT_NEAR(found.inverse[1], there.b - here.b, 1e-12);
  EXPECT_NEAR(found.inverse[2], there.c - here.c, 1e-12);
  EXPECT_NEAR(found.inverse[3], there.d - here.d, 1e-12);
}

TEST(BenchAppendix, FloatAboutDKeepsTheDeterminantOfEquation8) {
  EXPECT_NEAR(determinant_about_d(equation_8_in_float()), 1.216, 1e-4);
}

TEST(BenchAppendix, EveryFormOfEquation8IsListedBesideWhatThePaperPrints) {
  int beside_double = 0, beside_float = 0, alone = 0;
  const Json appendix = measure_appendix(10);
  for (const Json& form : appendix["determinants"]) {
    if (form["printed"].is_null()) {
      ++alone;
    } else if (form["form"].get<std::string>().find("double") != std::string::npos) {
      ++beside_double;
      EXPECT_EQ(form["printed"], 1.216);
    } else {
      ++beside_float;
      EXPECT_EQ(form["printed"], 2.010187);
    }
  }
  EXPECT_EQ(beside_double, 1);
  EXPECT_EQ(beside_float, 5);
  EXPECT_EQ(alone, 3);
}

TEST(BenchAppendix, FloatAboutDStaysAccurateWhereFloatByEquation6DoesNot) {
  const Json appendix = measure_appendix(2000);
  const Json& errors = appendix["relative_errors"];
  ASSERT_EQ(errors.size(), 4u);
  const auto of = [&](std::size_t n, const char* pointer) { return *number(errors[n], pointer); };
  for (std::size_t n = 0; n < errors.size(); ++n) {
    EXPECT_EQ(errors[n]["tetrahedra"], 2000);
    EXPECT_LT(of(n, "/float_3x3/largest"), 1e-6) << errors[n];
    EXPECT_LE(of(n, "/float_4x4/median"), of(n, "/float_4x4/largest"));
  }
  for (std::size_t n = 1; n < errors.size(); ++n) {
    EXPECT_GT(of(n, "/distance"), of(n - 1, "/distance"));
    EXPECT_GT(of(n, "/float_4x4/median"), 3 * of(n - 1, "/float_4x4/median"));
  }
  EXPECT_GT(of(2, "/float_4x4/median"), 1e-3);
}

}  // namespace
}  // namespace tetwarp::bench
