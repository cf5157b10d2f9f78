// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "tests/deform/simulate/scenario_volumes.h"
#include "tests/support/says.h"

namespace tetwarp::simulate {
namespace {

using namespace test;

TEST(Patient, HuOfACellIsTheMeanOfItsVoxelsAndOfTheLastThoseThatAreLeft) {
  // 6 voxels along i, cells of 3: voxels 0 1 2 | 3 4 5; along j, 4 voxels: 0 1 2 and, in a cell that overhangs, 3.
  const Geometry grid{.size = {6, 4, 3}};
  const auto hu = [](auto i, auto j, auto) { return 10 * i + 100 * j; };
  const Volume<std::int16_t> ct = ct_of(grid, hu);
  const Patient patient = examine(view(ct), nullptr, 3, -400);
  ASSERT_EQ(patient.lattice.size, glm::i64vec3(3, 2, 2));
  ASSERT_EQ(patient.cell_hu.size(), 2u);
  EXPECT_FLOAT_EQ(patient.cell_hu[0], 10 + 150);  // all of j: the lattice ends on a voxel centre
  EXPECT_FLOAT_EQ(patient.cell_hu[1], 40 + 150);
}

TEST(Patient, ALatticeThatOverhangsHasAMeanOfWhatThereIsAtEveryVertex) {
  const Geometry grid{.size = {10, 10, 10}};
  const Volume<std::int16_t> ct = ct_of(grid, [](auto i, auto, auto) { return i; });
  const Patient patient = examine(view(ct), nullptr, 8, -400);
  ASSERT_EQ(patient.lattice.size, glm::i64vec3(3));  // vertices at 0, 8, 16
  EXPECT_FLOAT_EQ(patient.vertex_hu[0], 1.5f);       // voxels 0 to 3
  EXPECT_FLOAT_EQ(patient.vertex_hu[1], 6.5f);       // 4 to 9
  EXPECT_FLOAT_EQ(patient.vertex_hu[2], 9);          // the last
  EXPECT_FLOAT_EQ(patient.cell_hu[0], 3.5f);
  EXPECT_FLOAT_EQ(patient.cell_hu[1], 8.5f);  // 8 and 9
}

TEST(Patient, PaddingAndNoNumbersCountAsAir) {
  Geometry grid;
  grid.size = {2, 2, 2};
  Volume<float> ct{grid, {-3024, std::nanf(""), -1024, -1024, -1024, -1024, -1024, -1024}};
  EXPECT_EQ(examine(view(ct), nullptr, 1, -400).cell_hu[0], -1024);
}

TEST(Patient, BodyIsTheLargestConnectedSetOfDenseCells) {
  // A block of 4 x 4 x 4 voxels, and a smaller one that touches it along an edge only.
  const Geometry grid{.size = {12, 12, 9}, .spacing = {2, 3, 4}, .origin = {10, 20, 30}};
  const Volume<std::int16_t> ct = ct_of(grid, [](auto i, auto j, auto k) {
    const bool large = i < 5 && j < 5 && k < 5, small = i >= 5 && i < 8 && j >= 5 && j < 8 && k < 5;
    return large || small ? 50 : -1000;
  });
  const Patient patient = examine(view(ct), nullptr, 1, -400);
  ASSERT_TRUE(patient.box.has_value());
  EXPECT_EQ(patient.box->low, glm::dvec3(10, 20, 30));
  EXPECT_EQ(patient.box->high, glm::dvec3(10 + 5 * 2, 20 + 5 * 3, 30 + 5 * 4));
  EXPECT_EQ(std::count(patient.body.begin(), patient.body.end(), 1), 125);
  EXPECT_FALSE(examine(view(ct), nullptr, 1, 60).box.has_value());
}

TEST(Patient, BoxEndsWithTheVolumeWhereTheLatticeOverhangsIt) {
  const Volume<std::int16_t> ct = ct_of({.size = {10, 10, 10}}, [](auto...) { return 0; });
  EXPECT_EQ(examine(view(ct), nullptr, 8, -400).box->high, glm::dvec3(9));
}

TEST(Patient, BoxOfATurnedLatticeHoldsItsCorners) {
  Geometry grid{.size = {5, 3, 3}};
  grid.direction = glm::dmat3(0.8, 0.6, 0, -0.6, 0.8, 0, 0, 0, 1);  // i to (0.8, 0.6), j to (-0.6, 0.8)
  const Volume<std::int16_t> ct = ct_of(grid, [](auto...) { return 0; });
  const Patient patient = examine(view(ct), nullptr, 1, -400);
  EXPECT_NEAR(patient.box->low.x, -0.6 * 2, 1e-12);
  EXPECT_NEAR(patient.box->high.x, 0.8 * 4, 1e-12);
  EXPECT_NEAR(patient.box->low.y, 0, 1e-12);
  EXPECT_NEAR(patient.box->high.y, 0.6 * 4 + 0.8 * 2, 1e-12);
}

TEST(Patient, LabelOfACellIsTheMostFrequentAndOfSeveralTheSmallest) {
  const Geometry grid{.size = {3, 2, 2}};
  const Volume<std::int16_t> ct = ct_of(grid, [](auto...) { return 0; });
  const Volume<std::uint8_t> labels{grid,
                                    {7, 7, 2, 7, 3, 3, 9, 7, 3, 7, 2, 2}};  // i = 0: 7 7 9 7; then 7 3 7 2 2 3 3 2
  const ConstVolumeView given = view(labels);
  const Patient patient = examine(view(ct), &given, 1, -400);
  EXPECT_EQ(patient.cell_label, (std::vector<std::int64_t>{7, 2}));
  EXPECT_EQ(patient.vertex_label.size(), 12u);
  EXPECT_EQ(patient.vertex_label[2], 2);

  Volume<std::uint8_t> elsewhere = labels;
  elsewhere.geometry.origin.x = 1;
  const ConstVolumeView moved = view(std::as_const(elsewhere));
  EXPECT_TRUE(
      says(refusal([&] { examine(view(ct), &moved, 1, -400); }), {"labels", "grid", "as many at another place"}));
  const Volume<float> half{grid, std::vector<float>(12, 0.5f)};
  const ConstVolumeView halves = view(half);
  EXPECT_TRUE(says(refusal([&] { examine(view(ct), &halves, 1, -400); }), {"0.5", "whole"}));
}

TEST(Zones, SphereBoxAndHalfSpaceHoldTheirBorders) {
  // Vertices along x at -20, -16, ... 20, along y the same, along z at 0, 8, ... 40.
  const Patient patient = uniform_patient();
  const auto count = [&](const Zone& zone) { return numbers_of(select(zone, patient)).size(); };
  EXPECT_EQ(count({Sphere{{{0, 0, 16}}, {4}}}), 5u);  // the middle, and four at 4 mm
  EXPECT_EQ(count({Sphere{{{0, 0, 16}}, {8}}}), 15u);
  EXPECT_EQ(count({AlignedBox{{{4, -4, 16}}, {{-4, 4, 8}}}}), 18u);  // corners in any order
  EXPECT_EQ(count({HalfSpace{{{0, 0, 32}}, {0, 0, 5}}}), 2u * 121);
  EXPECT_EQ(count({HalfSpace{{{0, 0, 32}}, {0, 0, -1}}}), 5u * 121);
  EXPECT_EQ(count({Border{}}), 11u * 11 * 6 - 9 * 9 * 4);
}

TEST(Zones, PartsOfTheBodyAreMeasuredByItsBox) {
  const Patient patient = uniform_patient();  // box (-20, -20, 0) to (20, 20, 40)
  EXPECT_EQ(point_of({{0.25, 0.5, 1}, Unit::body}, patient), glm::dvec3(-10, 0, 40));
  EXPECT_EQ(mm_of(Length{0.1, Unit::body}, patient), 4);
  EXPECT_EQ(mm_of(Shift{{0.5, 0, -0.25}, Unit::body}, patient), glm::dvec3(20, 0, -10));
  const Patient air = uniform_patient(-1000);
  EXPECT_TRUE(says(refusal([&] { point_of({{0, 0, 0}, Unit::body}, air); }), {"body", "give mm"}));
  EXPECT_EQ(point_of({{1, 2, 3}, Unit::mm}, air), glm::dvec3(1, 2, 3));
}

TEST(Zones, AlgebraIsThatOfSets) {
  const Patient patient = uniform_patient();
  const Zone left{HalfSpace{{{0, 0, 0}}, {1, 0, 0}}}, low{HalfSpace{{{0, 0, 8}}, {0, 0, -1}}};
  const auto a = select(left, patient), b = select(low, patient);
  const auto both = select({AllOf{{left, low}}}, patient), any = select({AnyOf{{left, low}}}, patient),
             none = select({Not{{left}}}, patient);
  std::size_t different = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    EXPECT_EQ(both[n], a[n] && b[n]);
    EXPECT_EQ(any[n], a[n] || b[n]);
    EXPECT_EQ(none[n], !a[n]);
    different += a[n] != b[n];
  }
  EXPECT_GT(different, 0u);
}

TEST(Zones, HuIsThatRoundAVertexFromLowUpToHigh) {
  const Volume<std::int16_t> ct = ct_of(small_grid(), [](auto i, auto, auto) {
    return i < 10 ? 40 : i < 20 ? 300 : 200;
  });
  const Patient patient = examine(view(ct), nullptr, 2, -400);
  const auto count = [&](double low, double high) { return numbers_of(select({HuRange{low, high}}, patient)).size(); };
  EXPECT_EQ(count(300, 301), 4u * 66);  // voxels round vertices 6 to 9 along i; of 5 (9 and 10) the mean is 170
  EXPECT_EQ(count(40, 300), 7u * 66);   // 0 to 5; and the last, 250
  EXPECT_EQ(count(-1000, 40), 0u);
  EXPECT_TRUE(says(refusal([&] { select({Labels{{1}}}, patient); }), {"--labels"}));
}

TEST(Zones, BodyHoldsTheVerticesOfItsCells) {
  const Geometry grid{.size = {5, 5, 5}};
  const Volume<std::int16_t> ct =
      ct_of(grid, [](auto i, auto j, auto k) { return i == 1 && j == 1 && k == 1 ? 500 : -1000; });
  const Patient patient = examine(view(ct), nullptr, 1, -400);
  EXPECT_EQ(numbers_of(select({Body{}}, patient)), (std::vector<std::size_t>{31, 32, 36, 37, 56, 57, 61, 62}));
}

TEST(Zones, HandleTakesTheNearestVertexWhereNoneIsWithinItsRadius) {
  const Patient patient = uniform_patient();
  EXPECT_EQ(grasp({0, 0, 16}, 4, patient).size(), 5u);
  EXPECT_EQ(grasp({1.5, 1, 18}, 0.5, patient), (std::vector<std::size_t>{5 + 11 * (5 + 11 * 2)}));
  EXPECT_TRUE(says(refusal([&] { grasp({100, 0, 16}, 4, patient); }), {"80", "4", "mm"}));
}

}  // namespace
}  // namespace tetwarp::simulate
