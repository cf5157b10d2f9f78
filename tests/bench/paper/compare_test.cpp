// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/backend.h"

#include <gtest/gtest.h>

namespace tetwarp::bench {
namespace {

TEST(BenchCompare, CountsEachVoxelForWhatItIs) {
  //                   as it should, off by 3, lost, twice, spilled, neither
  const Exact exact{{10, 20, 30, 40, -1024, -1024}, {1, 1, 1, 1, 0, 0}};
  const std::vector<std::int16_t> output = {10, 23, -1024, 40, 77, -1024};
  const std::vector<std::uint32_t> writes = {1, 1, 0, 2, 1, 0};
  const Tally tally = compare(exact, output, writes);
  EXPECT_EQ(tally.covered, 4u);
  EXPECT_EQ(tally.writes, 5u);
  EXPECT_EQ(tally.lost, 1u);
  EXPECT_EQ(tally.multiple, 1u);
  EXPECT_EQ(tally.spilled, 1u);
  EXPECT_EQ(tally.largest_difference, 3);
  EXPECT_EQ(tally.mean_difference, 1);
}

TEST(BenchCompare, DifferencesBeyondInt16AreNotWrapped) {
  const Exact exact{{-32768}, {1}};
  EXPECT_EQ(compare(exact, {32767}, {1}).largest_difference, 65535);
}

TEST(BenchCompare, OtherSizesAreRefused) {
  const Exact exact{{1, 2}, {1, 1}};
  EXPECT_THROW(compare(exact, {1}, {1, 1}), InputError);
  EXPECT_THROW(compare(exact, {1, 2}, {1}), InputError);
}

TEST(BenchCompare, OneMoreOrLessIsRoundingAndOnlyCoveredVoxelsCount) {
  //                 same, one more, one less, two more, far off, not covered
  const Exact exact{{10, 20, 30, 40, -32768, 50}, {1, 1, 1, 1, 1, 0}};
  const std::vector<std::int16_t> output = {10, 21, 29, 42, 32767, 0};
  EXPECT_DOUBLE_EQ(differing_fraction(exact, output), 0.4);
}

TEST(BenchCompare, ADifferenceNeedsTheSameSizeAndACoveredVoxel) {
  const std::vector<std::int16_t> output = {1, 2};
  EXPECT_THROW(differing_fraction({{1}, {1}}, output), InputError);
  EXPECT_THROW(differing_fraction({{1, 2}, {1}}, output), InputError);
  EXPECT_THROW(differing_fraction({{1, 2}, {0, 0}}, output), InputError);
}

}  // namespace
}  // namespace tetwarp::bench
