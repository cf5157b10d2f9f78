// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/ray_blocks.h"

#include <gtest/gtest.h>

#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using test::Random;
using test::seed_text;
using test::test_seed;
using test::unit_grid;

TEST(RayBlocks, RowsOfRegionsAreThoseThatReachThem) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 8100);
  for (int n = 0; n < 200; ++n) {
    const Geometry grid = unit_grid({20, random.integer(2, 60), random.integer(2, 60)});
    const glm::ivec3 blocks = ray_blocks(grid);
    Region region{{0, 0, 0}, {1, 0, 0}};
    for (int axis = 1; axis < 3; ++axis) {
      region.begin[axis] = random.integer(0, grid.size[axis] - 1);
      region.end[axis] = random.integer(region.begin[axis], grid.size[axis]);
    }
    std::vector<int> expected;
    for (int row = 0; row < blocks.y * blocks.z; ++row) {
      const RayReach y(row % blocks.y, static_cast<int>(grid.size.y)), z(row / blocks.y, static_cast<int>(grid.size.z));
      bool reaches = false;
      for (std::int64_t j = region.begin.y; j < region.end.y; ++j) {
        for (std::int64_t k = region.begin.z; k < region.end.z; ++k)
          reaches = reaches || (y.begin <= j && j < y.end && z.begin <= k && k < z.end);
      }
      if (reaches) expected.push_back(row);
    }
    EXPECT_EQ(block_rows_of(grid, {&region, 1}), expected) << to_string(region.begin);
  }
}

}  // namespace
}  // namespace tetwarp
