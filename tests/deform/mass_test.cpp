// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/mass.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using namespace test;

TEST(Mass, DensityIsDividedByTheDeterminant) {
  const Geometry grid = unit_grid({7, 1, 2});
  const Volume<float> hu{grid, {0, 0, 100.5F, -1000, -1024, 3000, 40, 1, 2, 3, 4, 5, 6, 7}};
  Volume<float> jacobian{grid, {1, 2, 1, 0.5F, NAN, 0.1F, -2, 1, 1, 1, 1, 1, 1, 1}};
  Volume<std::int16_t> output{grid, std::vector<std::int16_t>(14, 77)};
  Volume<std::uint8_t> coverage{grid, std::vector<std::uint8_t>(14, 1)};
  const Maps maps{.coverage = view(coverage), .jacobian = view(jacobian)};
  const Region first{{0, 0, 0}, {7, 1, 1}};
  EXPECT_EQ(preserve_mass(view(hu), maps, {}, view(output), first), 1U);
  // (3000 + 1000) / 0.1 - 1000 = 39000 is beyond int16; 100.5 is rounded to even.
  EXPECT_EQ(output.voxels,
            (std::vector<std::int16_t>{0, -500, 100, -1000, -1024, 32767, -480, 77, 77, 77, 77, 77, 77, 77}));
  Volume<float> exact{grid, std::vector<float>(14)};
  EXPECT_EQ(preserve_mass(view(hu), maps, {}, view(exact), whole(grid)), 0U);
  EXPECT_EQ(exact.voxels[2], 100.5F);
  EXPECT_NEAR(exact.voxels[5], 39000, 0.01);  // 0.1 is a float
  EXPECT_EQ(exact.voxels[13], 7);
}

TEST(Mass, WhatIsNoDensityKeepsItsValue) {
  const Geometry grid = unit_grid({5, 1, 2});
  // Background, two ends of the padding, and two values beside it.
  const Volume<float> hu{grid, {0, -2000, -1500, -2001, -1499, 0, 0, 0, 0, 0}};
  Volume<float> jacobian{grid, std::vector<float>(10, 0.5F)};
  Volume<std::uint8_t> coverage{grid, {0, 1, 1, 1, 1, 1, 1, 1, 1, 1}};
  Volume<std::int16_t> output{grid, std::vector<std::int16_t>(10, 77)};
  const Maps maps{.coverage = view(coverage), .jacobian = view(jacobian)};
  preserve_mass(view(hu), maps, PaddingRange{-2000, -1500}, view(output), whole(grid));
  EXPECT_EQ(output.voxels, (std::vector<std::int16_t>{0, -2000, -1500, -3002, -1998, 1000, 1000, 1000, 1000, 1000}));
}

TEST(Mass, ValuesThatFloatDoesNotHoldAreHeldInDouble) {
  for (const VoxelType type : {VoxelType::i32, VoxelType::u32, VoxelType::f64})
    EXPECT_EQ(type_of_mass(type), VoxelType::f64);
  for (const VoxelType type : {VoxelType::u8, VoxelType::i16, VoxelType::u16, VoxelType::f32})
    EXPECT_EQ(type_of_mass(type), VoxelType::f32);
  const Geometry grid = unit_grid({2, 1, 2});
  const Volume<double> hu{grid, {123456789, 987654321, 0.1, -5}};
  Volume<float> jacobian{grid, {1, 1, 1, 1}};
  Volume<std::uint8_t> coverage{grid, {1, 0, 1, 1}};
  Volume<std::int32_t> output{grid, std::vector<std::int32_t>(4)};
  const Maps maps{.coverage = view(coverage), .jacobian = view(jacobian)};
  preserve_mass(view(hu), maps, {}, view(output), whole(grid));
  EXPECT_EQ(output.voxels, (std::vector<std::int32_t>{123456789, 987654321, 0, -5}));
}

TEST(Mass, NeedsFloatsOnOneGrid) {
  const Geometry grid = unit_grid({2, 2, 2});
  const Geometry grid3 = unit_grid({2, 2, 3});
  const Volume<float> hu{grid, std::vector<float>(8)};
  Volume<float> jacobian{grid, std::vector<float>(8)}, larger{grid3, std::vector<float>(12)};
  Volume<std::uint8_t> coverage{grid, std::vector<std::uint8_t>(8)};
  Volume<std::int16_t> output{grid, std::vector<std::int16_t>(8)};
  const auto scale = [&](const ConstVolumeView& from, const Maps& maps) {
    preserve_mass(from, maps, {}, view(output), whole(grid));
  };
  EXPECT_NO_THROW(scale(view(hu), {.coverage = view(coverage), .jacobian = view(jacobian)}));
  EXPECT_THROW(scale(view(hu), {.coverage = view(coverage), .jacobian = view(larger)}), InputError);
  EXPECT_THROW(scale(view(hu), {.coverage = view(coverage), .jacobian = view(output)}), InputError);
  EXPECT_THROW(scale(view(hu), {.jacobian = view(jacobian)}), InputError);
  EXPECT_THROW(scale(view(std::as_const(output)), {.coverage = view(coverage), .jacobian = view(jacobian)}),
               InputError);
}

}  // namespace
}  // namespace tetwarp
