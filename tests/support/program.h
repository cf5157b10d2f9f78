// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

/// What a finished run of the program left behind.
struct Outcome {
  int status = -1;
  std::string out, err;
};

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Runs `PROGRAM ARGUMENTS` in a folder, through the shell.
inline Outcome run_program(const std::filesystem::path& folder, const std::string& program,
                           const std::string& arguments) {
  const std::filesystem::path out = folder / ".stdout", err = folder / ".stderr";
  const std::string command =
      "cd '" + folder.string() + "' && '" + program + "' " + arguments + " > .stdout 2> .stderr";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(out), read_text(err)};
}

/// Runs `tetwarp ARGUMENTS` in a folder, through the shell.
inline Outcome run_tetwarp(const std::filesystem::path& folder, const std::string& arguments) {
  return run_program(folder, TETWARP_PROGRAM, arguments);
}
