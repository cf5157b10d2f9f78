// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/files/module.h"

#include <gtest/gtest.h>

#include "deform/errors.h"
#include "tests/support/says.h"

namespace tetwarp {
namespace {

TEST(Module, WhatIsNotThereIsNotFound) {
  EXPECT_EQ(find_in_module("libtetwarp_absent.so", "malloc"), nullptr);
  EXPECT_EQ(find_in_module("libm.so.6", "tetwarp_absent"), nullptr);
  EXPECT_NE(find_in_module("libm.so.6", "sin"), nullptr);
}

TEST(Module, RefusalNamesModuleAndFile) {
  std::string words;
  try {
    refuse_without_module("files of a kind", "libx.so", "a.kind", ", or write another");
  } catch (const NotCompiled& error) {
    words = error.what();
  }
  EXPECT_TRUE(says(words, {"files of a kind need libx.so", "a.kind", "lib/tetwarp beside", ", or write another"}));
}

}  // namespace
}  // namespace tetwarp
