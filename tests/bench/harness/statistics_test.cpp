// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/results.h"

#include <gtest/gtest.h>

#include "deform/errors.h"

namespace tetwarp::bench {
namespace {

TEST(BenchStatistics, MedianAndQuartilesOfKnownNumbers) {
  const Json odd = summarize({9, 1, 7, 3, 5});
  EXPECT_EQ(odd["median"], 5);
  EXPECT_EQ(odd["q1"], 3);
  EXPECT_EQ(odd["q3"], 7);
  EXPECT_EQ(odd["min"], 1);
  EXPECT_EQ(odd["max"], 9);
  EXPECT_EQ(odd["frames"], 5);
  const Json even = summarize({40, 10, 30, 20});
  EXPECT_EQ(even["median"], 25);
  EXPECT_EQ(even["q1"], 17.5);
  EXPECT_EQ(even["q3"], 32.5);
}

TEST(BenchStatistics, OneFrameIsItsOwnSummary) {
  const Json one = summarize({4});
  EXPECT_EQ(one["median"], 4);
  EXPECT_EQ(one["q1"], 4);
  EXPECT_EQ(one["q3"], 4);
  EXPECT_EQ(one["frames"], 1);
}

TEST(BenchStatistics, NoFramesAreRefused) { EXPECT_THROW(summarize({}), InputError); }

}  // namespace
}  // namespace tetwarp::bench
