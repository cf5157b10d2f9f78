// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/other_readers.h"

namespace tetwarp::test {

/// The different lines of a program's output that hold a word.
inline std::set<std::string> lines_with(const std::string& word, const std::string& command) {
  std::set<std::string> lines;
  std::istringstream output(run_command(command).output);
  for (std::string line; std::getline(output, line);) {
    if (line.find(word) != std::string::npos) lines.insert(line);
  }
  return lines;
}

/// The different errors of dciodvfy (dicom3tools) over all slices.
inline std::set<std::string> dciodvfy_errors(const std::vector<std::filesystem::path>& files) {
  std::set<std::string> lines;
  for (const std::filesystem::path& file : files) lines.merge(lines_with("Error", "dciodvfy " + quoted(file)));
  return lines;
}

/// What dcentvfy (dicom3tools) says of files as one series: it prints differences only.
inline std::set<std::string> dcentvfy_errors(const std::vector<std::filesystem::path>& files) {
  std::string command = "dcentvfy";
  for (const std::filesystem::path& file : files) command.append(" ").append(quoted(file));
  return lines_with("", command);
}

}  // namespace tetwarp::test
