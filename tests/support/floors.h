// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "bench/harness/results.h"

namespace tetwarp::test {

inline const bench::Floor* find_floor(const bench::Floors& floors, const std::string& ratio, const std::string& where) {
  for (const bench::Floor& floor : floors) {
    if (floor.ratio == ratio && floor.where == where) return &floor;
  }
  return nullptr;
}

/// A time in a run that was the same in every frame, ms.
inline bench::Json steady_ms(double median) { return bench::summarize({median, median, median}); }

/// Expects a floor with these numbers. @param met  whether the requirement is met; does not count where nothing is
/// required
inline void expect_floor(const bench::Floors& floors, const std::string& ratio, const std::string& where, double value,
                         std::optional<double> required, std::optional<bool> met, double tolerance = 1e-12) {
  const bench::Floor* floor = find_floor(floors, ratio, where);
  ASSERT_TRUE(floor) << ratio << ", " << where;
  EXPECT_NEAR(floor->value, value, tolerance) << ratio << ", " << where;
  EXPECT_EQ(floor->required, required) << ratio << ", " << where;
  if (required && met) {
    EXPECT_EQ(floor->meets(*required), *met) << ratio << ", " << where;
  }
}

}  // namespace tetwarp::test
