// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

/// Whether a message holds all of the words; a failed test shows the message.
inline testing::AssertionResult says(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (text.find(word) == std::string::npos) {
      return testing::AssertionFailure() << "no \"" << word << "\" in: " << text;
    }
  }
  return testing::AssertionSuccess();
}
