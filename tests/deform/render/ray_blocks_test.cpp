// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/ray_blocks.h"

#include <gtest/gtest.h>

#include "deform/render/ray_frame.h"
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

TEST(RayBlocks, BlocksOfRegionsAreThoseThatReachThem) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 8102);
  for (int n = 0; n < 100; ++n) {
    const Geometry grid = unit_grid({random.integer(2, 40), random.integer(2, 40), random.integer(2, 40)});
    const glm::ivec3 blocks = ray_blocks(grid), size(grid.size);
    std::vector<Region> regions(static_cast<std::size_t>(random.integer(0, 3)));
    for (Region& region : regions) {
      for (int axis = 0; axis < 3; ++axis) {
        region.begin[axis] = random.integer(0, grid.size[axis] - 1);
        region.end[axis] = random.integer(region.begin[axis], std::min(region.begin[axis] + 12, grid.size[axis]));
      }
    }
    const auto reaches = [&](const glm::ivec3& block) {
      return std::any_of(regions.begin(), regions.end(), [&](const Region& region) {
        for (int axis = 0; axis < 3; ++axis) {
          const RayReach reach(block[axis], size[axis]);
          if (std::max<std::int64_t>(reach.begin, region.begin[axis]) >=
              std::min<std::int64_t>(reach.end, region.end[axis]))
            return false;
        }
        return true;
      });
    };
    std::vector<std::uint8_t> marked;
    mark_blocks_of(grid, regions, marked);
    std::size_t number = 0;
    for (int z = 0; z < blocks.z; ++z)
      for (int y = 0; y < blocks.y; ++y)
        for (int x = 0; x < blocks.x; ++x, ++number)
          ASSERT_EQ(marked[number] != 0, reaches({x, y, z})) << x << ' ' << y << ' ' << z;
    EXPECT_EQ(marked.size(), number);
  }
}

/// Whatever is seen of some values has one of `seen_values` between them; and more than an entry around what is seen
/// there is none.
TEST(RayBlocks, SeenValuesAreThoseOfBlocksThatAreNotEmpty) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 8101);
  const Geometry grid = unit_grid({20, 20, 20});
  std::vector<TransferFunction> transfers;
  for (const std::string& name : transfer_function_names()) transfers.push_back(transfer_function(name));
  transfers.push_back(
      {"two bands",
       Projection::composite,
       {{-100, {}, 0}, {0, {}, 0}, {10, {}, 0.5}, {20, {}, 0}, {300, {}, 0}, {310, {}, 0.1}, {320, {}, 0}}});
  transfers.push_back({"ends", Projection::composite, {{-100, {}, 0.5}, {0, {}, 0}, {500, {}, 0}, {600, {}, 1}}});
  for (const TransferFunction& transfer : transfers) {
    SCOPED_TRACE(transfer.name);
    const RenderStyle style{.transfer = transfer};
    const RayFrame frame = ray_frame(grid, style, view_plane({}, grid));
    const std::vector<int> before = opaque_before(transfer_table(transfer, 1));
    const std::vector<ValueRange> seen = seen_values(style);
    const double low = transfer.points.front().value, high = transfer.points.back().value,
                 entry = (high - low) / (kTransferEntries - 1);
    const auto meets = [&](double least, double most) {
      return std::any_of(seen.begin(), seen.end(),
                         [&](const ValueRange& range) { return least <= range.high && range.low <= most; });
    };
    int empty = 0, met = 0;
    for (int n = 0; n < 20000; ++n) {
      const double least = random.real(low - 300, high + 300),
                   most = least + (random.chance(0.5) ? random.real(0, 3 * entry) : random.real(0, 400));
      if (!is_empty({static_cast<float>(least), static_cast<float>(most)}, frame, before.data())) {
        ASSERT_TRUE(meets(least, most)) << least << " to " << most;
        ++met;
      } else if (is_empty({static_cast<float>(least - 2 * entry), static_cast<float>(most + 2 * entry)}, frame,
                          before.data())) {
        ASSERT_FALSE(meets(least, most)) << least << " to " << most;
        ++empty;
      }
    }
    EXPECT_GT(met, 100);
    EXPECT_GT(empty, 100);
  }
}

}  // namespace
}  // namespace tetwarp
