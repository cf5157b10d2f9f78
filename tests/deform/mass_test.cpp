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
  const Volume<float> jacobian{grid, {1, 2, 1, 0.5F, NAN, 0.1F, -2, 1, 1, 1, 1, 1, 1, 1}};
  Volume<std::int16_t> output{grid, std::vector<std::int16_t>(14, 77)};
  const Region first{{0, 0, 0}, {7, 1, 1}};
  EXPECT_EQ(preserve_mass(view(hu), view(jacobian), view(output), first), 1U);
  // (3000 + 1000) / 0.1 - 1000 = 39000 is beyond int16; 100.5 is rounded to even.
  EXPECT_EQ(output.voxels,
            (std::vector<std::int16_t>{0, -500, 100, -1000, -1024, 32767, -480, 77, 77, 77, 77, 77, 77, 77}));
  Volume<float> exact{grid, std::vector<float>(14)};
  EXPECT_EQ(preserve_mass(view(hu), view(jacobian), view(exact), whole(grid)), 0U);
  EXPECT_EQ(exact.voxels[2], 100.5F);
  EXPECT_NEAR(exact.voxels[5], 39000, 0.01);  // 0.1 is a float
  EXPECT_EQ(exact.voxels[13], 7);
}

TEST(Mass, NeedsFloatsOnOneGrid) {
  const Geometry grid = unit_grid({2, 2, 2});
  const Volume<float> hu{grid, std::vector<float>(8)}, larger{unit_grid({2, 2, 3}), std::vector<float>(12)};
  Volume<std::int16_t> output{grid, std::vector<std::int16_t>(8)};
  EXPECT_THROW(preserve_mass(view(hu), view(larger), view(output), whole(grid)), InputError);
  EXPECT_THROW(preserve_mass(view(std::as_const(output)), view(hu), view(output), whole(grid)), InputError);
}

}  // namespace
}  // namespace tetwarp
