// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>
#include <unistd.h>

#include "bench/harness/results.h"

namespace tetwarp::bench {
namespace {

TEST(BenchMachine, AvailableMemoryIsSomeAndNotMoreThanThereIs) {
  const std::uint64_t all =
      static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  EXPECT_GT(available_bytes(), std::uint64_t{1} << 20);
  EXPECT_LE(available_bytes(), all);
}

TEST(BenchMachine, ThreadsAreThoseAskedForOrAll) {
  EXPECT_EQ(describe_machine(-1, 3)["threads"], 3);
  EXPECT_GE(describe_machine(-1, 0)["threads"], 1);
  EXPECT_FALSE(describe_machine(-1, 0)["cpu"].get<std::string>().empty());
}

}  // namespace
}  // namespace tetwarp::bench
