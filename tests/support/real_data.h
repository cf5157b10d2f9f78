// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

/// The folder of an unpacked set of real series ($TETWARP_TEST_DATA/SET); empty if it is absent.
inline std::filesystem::path real_data(const std::string& set) {
  const char* root = std::getenv("TETWARP_TEST_DATA");
  if (!root) return {};
  const std::filesystem::path folder = std::filesystem::path(root) / set;
  return std::filesystem::exists(folder) ? folder : std::filesystem::path();
}

/// Defines `folder` as the folder of a set. If it is absent the test is skipped with a reason.
#define TETWARP_REAL_DATA(folder, set)                 \
  const std::filesystem::path folder = real_data(set); \
  if (folder.empty()) GTEST_SKIP() << "no real data: " << (set) << " is not in $TETWARP_TEST_DATA"
