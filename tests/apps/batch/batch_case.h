// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp::test {

/// A folder with volumes to be deformed in batches: `ct.nii.gz`, `ct.nrrd` and `series`, small phantoms.
class BatchCase : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* output : {"ct.nii.gz", "ct.nrrd", "series"}) {
      ASSERT_EQ(run(std::string("phantom --size 40,40,16 --spacing 9,9,12 --quiet -o ") + output).status, 0);
    }
  }

  Outcome run(const std::string& arguments) const { return run_tetwarp(scratch_.path(), arguments); }
  /// Runs `tetwarp batch manifest -o OUT` on a manifest of these lines of JSON.
  Outcome batch(const std::string& lines, const std::string& more = "-o out --quiet") const {
    write_file(scratch_ / "m.jsonl", lines);
    return run("batch m.jsonl " + more);
  }
  std::map<std::string, nlohmann::json> lines_of(const std::string& name) const {
    std::map<std::string, nlohmann::json> lines;
    std::istringstream text(read_text(scratch_ / name));
    for (std::string line; std::getline(text, line);) {
      const nlohmann::json parsed = nlohmann::json::parse(line);
      lines[parsed["case"].get<std::string>()] = parsed;
    }
    return lines;
  }
  /// The words before a command that let another user run it, who may write into the folder. They are empty if the
  /// caller is not root, for permissions stop the caller then; root is stopped by none. No value: the other user cannot
  /// reach the program.
  std::optional<std::string> as_another_user(int id) const {
    std::filesystem::permissions(scratch_.path(), std::filesystem::perms::all);
    if (geteuid() != 0) return "";
    const std::string as_other = "setpriv --reuid=" + std::to_string(id) + " --clear-groups ";
    const std::string tried = "-c '" + as_other + TETWARP_PROGRAM + " --version'";
    if (run_program(scratch_.path(), "/bin/sh", tried).status != 0) return std::nullopt;
    return as_other;
  }
  /// The bytes of all files below a folder, by name. Files that hold times are left out.
  std::map<std::string, std::string> files_of(const std::string& folder) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(scratch_ / folder)) {
      const std::string name = entry.path().lexically_relative(scratch_ / folder).string();
      if (entry.is_regular_file() && !name.starts_with("timings")) files[name] = read_text(entry.path());
    }
    return files;
  }

  Scratch scratch_;
};

/// Six cases of several kinds.
inline constexpr const char* kSixCases =
    R"({"case": "a", "input": "ct.nii.gz", "field": "elastic:amplitude=2..8,spacing=60..90", "seed": 3, "variants": 3, "cell-size": 2}
{"case": "b", "input": "series", "field": "twist:angle=10", "output": "dicom", "cell-size": 4}
{"case": "c", "input": "ct.nrrd", "field": ["wave:amplitude=8,wavelength=200", "translate:by=2/0/0"], "output": "c.mha", "inverse": "inverse.mha", "write-field": "f.nrrd"}
{"case": "d", "input": "ct.nrrd", "field": "bubble:radius=80,strength=0.4", "with": ["ct.nii.gz=also.nrrd:nearest"], "coverage": "cov.nii.gz"}
)";

}  // namespace tetwarp::test
