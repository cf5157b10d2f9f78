// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/value_counts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using namespace test;
using Counts = std::map<double, std::uint64_t>;

TEST(ValueCounts, RunsOfEachTypeAreCounted) {
  const Geometry grid = unit_grid({3, 2, 2});
  EXPECT_EQ(count_values(view(Volume<std::uint8_t>{grid, {0, 0, 0, 255, 255, 0, 7, 7, 7, 7, 0, 255}})),
            (Counts{{0, 5}, {7, 4}, {255, 3}}));
  EXPECT_EQ(count_values(view(Volume<std::int32_t>{grid, {-5, -5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 2147483647}})),
            (Counts{{-5, 2}, {4, 9}, {2147483647, 1}}));
  EXPECT_EQ(count_values(view(Volume<float>{grid, {NAN, NAN, 0, -0.0F, 0.5F, NAN, 1, 1, 1, 1, 1, 1}})),
            (Counts{{0, 2}, {0.5, 1}, {1, 6}}));
}

TEST(ValueCounts, ThreadsGiveTheSame) {
  const Geometry grid = unit_grid({31, 17, 64});
  Volume<std::uint16_t> labels{grid, std::vector<std::uint16_t>(static_cast<std::size_t>(voxel_count(grid)))};
  Counts expected;
  for (std::size_t n = 0; n < labels.voxels.size(); ++n) {
    labels.voxels[n] = static_cast<std::uint16_t>(n * n / 1000 % 300);
    ++expected[labels.voxels[n]];
  }
  for (const int threads : {1, 2, 5}) EXPECT_EQ(count_values(view(labels), {.threads = threads}), expected) << threads;
}

TEST(ValueCounts, RefusesWhatIsNoWholeVolumeOfOneValue) {
  const Geometry grid = unit_grid({4, 2, 2});
  AnyVolume vectors(grid, VoxelType::f32, 3);
  EXPECT_THROW(count_values(vectors.view()), InputError);
  Volume<float> volume{grid, std::vector<float>(16)};
  ConstVolumeView part = view(volume);
  part.buffered.end.z = 1;
  EXPECT_THROW(count_values(part), InputError);
  EXPECT_THROW(count_values({}), InputError);
}

}  // namespace
}  // namespace tetwarp
