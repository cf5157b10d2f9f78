// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// bench/publish/publish.py, which makes tables, lines and documents of what the benchmark wrote.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp::test {

inline const std::filesystem::path kSources = TETWARP_SOURCES;
inline const std::filesystem::path kResults = kSources / "bench/results";

inline std::string quoted(const std::filesystem::path& path) { return "'" + path.string() + "'"; }

class Publish : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(TETWARP_PYTHON)) GTEST_SKIP() << "no python3 on this machine";
  }
  Outcome publish(const std::string& arguments) const {
    return run_program(scratch_.path(), TETWARP_PYTHON,
                       "-B " + quoted(kSources / "bench/publish/publish.py") + " " + arguments);
  }
  /// What the script makes of numbers: "md", "csv" or "json".
  std::string made_of(const nlohmann::json& numbers, const std::string& suffix) const {
    write_file(scratch_ / "numbers.json", numbers.dump());
    const Outcome run = publish("numbers.json made." + suffix);
    EXPECT_EQ(run.status, 0) << run.err;
    return read_text(scratch_ / ("made." + suffix));
  }

  const Scratch scratch_;
};

}  // namespace tetwarp::test
