// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/large_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

namespace tetwarp {
namespace {

TEST(LargeMemory, HoldsZerosHoweverMuchItIs) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{3'000'001}, std::size_t{21'000'003}}) {
    std::vector<std::int16_t> values;
    resize_large(values, count, 3);
    ASSERT_EQ(values.size(), count);
    EXPECT_EQ(std::ranges::count(values, 0), std::ssize(values)) << count;
    std::ranges::fill(values, 1);  // all of it can be written
    EXPECT_EQ(std::ranges::count(values, 1), std::ssize(values)) << count;
  }
}

TEST(LargeMemory, WhatLiesAroundItIsLeftAlone) {
  // A part that neither starts nor ends on a page: its neighbours keep what they hold.
  std::vector<std::uint8_t> values(20'000'000, 7);
  prepare_memory(std::as_writable_bytes(std::span(values).subspan(1234, 12'345'678)), 2);
  EXPECT_EQ(std::ranges::count(values, 7), std::ssize(values));
}

}  // namespace
}  // namespace tetwarp
