// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Which places the outputs of one command may have beside one another.
#include "apps/cli/output.h"

#include <gtest/gtest.h>

#include "apps/cli/reads.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;
using namespace tetwarp::apps;

/// Whether one of two places, written without links and "..", is the other or lies inside it.
bool touch(const std::string& a, const std::string& b) {
  return (a + '/').starts_with(b + '/') || (b + '/').starts_with(a + '/');
}

TEST(OutputSet, RefusesJustThePlacesThatAreInsideOrAroundAnotherOneInAnyOrder) {
  const Scratch scratch;
  // Signs that come before and after a slash stand behind the same word.
  const std::vector<std::string> names = {"a", "a/x", "a/x/y", "a/xy", "a-b", "a.nii", "a0", "a/x-y", "b", "A"};
  for (const std::string& first : names) {
    for (const std::string& second : names) {
      for (const std::string& third : names) {
        OutputSet outputs(Reads(), false, {}, true);
        std::vector<std::string> taken;
        for (const std::string& name : {first, second, third}) {
          bool expected = false, refused = false;
          for (const std::string& other : taken) expected = expected || touch(name, other);
          try {
            outputs.add(scratch / name);
          } catch (const UsageError& error) {
            refused = true;
            EXPECT_NE(std::string(error.what()).find((scratch / name).string() + ";"), std::string::npos)
                << error.what();
          }
          ASSERT_EQ(refused, expected) << first << ' ' << second << ' ' << third << " at " << name;
          if (!refused) taken.push_back(name);
        }
      }
    }
  }
}

}  // namespace
