// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/model.h"

#include <gtest/gtest.h>

#include "deform/errors.h"
#include "tests/support/says.h"

namespace tetwarp::simulate {
namespace {

Geometry lattice(const glm::i64vec3& size, const glm::dvec3& spacing) {
  return {.size = size, .spacing = spacing, .origin = {3, -4, 5}};
}

/// C_ijkl of one vertex's share of springs in an endless lattice, N/mm2.
double elasticity(const glm::dvec3& h, int i, int j, int k, int l) {
  const SpringConstants springs = spring_constants(h);
  double sum = 0;
  for (int d = kDirections / 2; d < kDirections; ++d) {  // each spring from one of its ends
    const glm::dvec3 r = h * glm::dvec3(link_steps(d));
    sum += springs.along[static_cast<std::size_t>(d)] * r[i] * r[j] * r[k] * r[l] / (r.x * r.x + r.y * r.y + r.z * r.z);
  }
  return sum / (h.x * h.y * h.z);
}

TEST(LatticeModel, SpringsOfACellHaveYoungsModulusOneAndPoissonsRatioOneFourth) {
  for (const glm::dvec3& h : {glm::dvec3(1), glm::dvec3(6.4, 6.4, 8), glm::dvec3(5, 6, 7)}) {
    constexpr double kShear = 1 / 2.5;  // mu and lambda are equal
    for (int a = 0; a < 3; ++a) {
      EXPECT_NEAR(elasticity(h, a, a, a, a), 3 * kShear, 1e-12);
      EXPECT_NEAR(elasticity(h, a, a, (a + 1) % 3, (a + 1) % 3), kShear, 1e-12);
    }
  }
  const SpringConstants cube = spring_constants(glm::dvec3(2));
  EXPECT_NEAR(cube.along[static_cast<std::size_t>(direction_of(1, 1, 1))], 6.0 / 35 * 2, 1e-12);
  EXPECT_NEAR(cube.along[static_cast<std::size_t>(direction_of(1, 0, 0))], 11.0 / 3 * 6 / 35 * 2, 1e-12);
}

TEST(LatticeModel, DirectionsHaveNumbersAndWaysBack) {
  for (int d = 0; d < kDirections; ++d) {
    const glm::ivec3 steps = link_steps(d);
    EXPECT_EQ(direction_of(steps.x, steps.y, steps.z), d);
    EXPECT_EQ(link_steps(opposite(d)), -steps);
  }
}

TEST(LatticeModel, LinksAreTheSameFromBothEndsAndEndAtTheBorder) {
  const std::vector<Tissue> tissues{{.name = "soft"}, {.name = "hard", .youngs_modulus_kpa = 1000, .stretch = 0.01}};
  const std::vector<std::uint8_t> of_cell{0, 1, 0, 1, 1, 0};
  const Model model = make_model(lattice({4, 3, 2}, {6, 6, 8}), of_cell, tissues);
  ASSERT_EQ(model.nodes(), 24u);
  std::size_t links = 0;
  for (int d = 0; d < kDirections; ++d) {
    for (std::size_t n = 0; n < model.nodes(); ++n) {
      const std::int32_t other = model.neighbour[model.link(d, n)];
      if (other < 0) {
        EXPECT_EQ(model.stiffness[model.link(d, n)], 0);
        continue;
      }
      ++links;
      const std::size_t back = model.link(opposite(d), static_cast<std::size_t>(other));
      EXPECT_EQ(model.neighbour[back], static_cast<std::int32_t>(n));
      EXPECT_EQ(model.stiffness[back], model.stiffness[model.link(d, n)]);
      EXPECT_GT(model.stiffness[back], 0);
    }
  }
  // along axes; two diagonals of each face, four of each cell, of 3 x 2 x 1 cells
  EXPECT_EQ(links, 2u * (18 + 16 + 12 + 2 * (2 * 6 + 9 + 8) + 4 * 6));
}

TEST(LatticeModel, LimitsAreTheTightestOfTheCellsRoundALink) {
  const std::vector<Tissue> tissues{{.name = "soft"},
                                    {.name = "hard", .compression = 0.05, .stretch = 0.01, .shear = 0.02}};
  const Model model = make_model(lattice({3, 2, 2}, {6, 7, 8}), std::vector<std::uint8_t>{0, 1}, tissues);
  const auto limits = [&](int axis, std::size_t node) {
    return model.limits[static_cast<std::size_t>(axis) * 12 + node];
  };
  EXPECT_FLOAT_EQ(limits(0, 0).longest, 1.2f);
  EXPECT_FLOAT_EQ(limits(0, 1).longest, 0.06f);
  EXPECT_FLOAT_EQ(limits(1, 0).shortest, -1.4f);
  EXPECT_FLOAT_EQ(limits(1, 1).shortest, -0.35f);  // the tighter limit of the two cells
  EXPECT_FLOAT_EQ(limits(2, 1).shear, 0.16f);
  EXPECT_EQ(limits(0, 2).longest, 0);  // no link
}

TEST(LatticeModel, ArraysThatDoNotFitAndTissueOutOfRangeAreRefused) {
  const Geometry grid = lattice({3, 2, 2}, {6, 7, 8});
  const std::vector<Tissue> one{{.name = "soft"}};
  const auto refused = [&](std::vector<std::uint8_t> cells, std::vector<Tissue> tissues) {
    try {
      make_model(grid, cells, tissues);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(says(refused({0}, one), {"one tissue a cell", "2", "found 1"}));
  EXPECT_TRUE(says(refused({0, 1}, one), {"the cell 1", "tissue 1", "there are 1"}));
  EXPECT_TRUE(
      says(refused({0, 0}, {{.name = "lead", .youngs_modulus_kpa = -1}}), {"\"lead\"", "Young's modulus", "-1"}));
  EXPECT_TRUE(says(refused({0, 0}, {{.name = "lead", .compression = 1.5}}), {"\"lead\"", "compression", "1.5"}));
}

}  // namespace
}  // namespace tetwarp::simulate
