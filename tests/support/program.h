// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
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

/// An environment variable while this object lives, of this process and of programs that it runs.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* const before = std::getenv(name)) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  ~Variable() {
    if (before_)
      ::setenv(name_, before_->c_str(), 1);
    else
      ::unsetenv(name_);
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

/// Hides CUDA devices from programs that are run while it stands: for tests of what the CPU does, or of memory, which
/// the driver of a device takes as well.
struct NoDevices : Variable {
  NoDevices() : Variable("CUDA_VISIBLE_DEVICES", "") {}
};

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
