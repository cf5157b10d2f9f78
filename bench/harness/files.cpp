// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/files.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <system_error>

#include "bench/harness/options.h"
#include "io/read_places.h"
#include "io/staged_output.h"

extern char** environ;

namespace tetwarp::bench {

namespace fs = std::filesystem;

void require_writable(const std::filesystem::path& path, const std::vector<std::filesystem::path>& reads) {
  if (path.empty()) return;
  ReadPlaces places;
  for (const std::filesystem::path& read : reads) {
    if (!read.empty()) places.add(read);
  }
  if (const auto input = places.touched_by(path))
    throw UsageError("the output " + path.string() + " is, is inside, or is around the input " + input->string() +
                     "; choose another place");
  StagedOutput(path, StagedOutput::Kind::file, true);
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  if (path.empty()) return;
  StagedOutput output(path, StagedOutput::Kind::file, true);
  std::ofstream file(output.path(), std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Error("cannot be written, " + path.string() + "; is the disk full?");
  output.commit();
}

ScratchFolder::ScratchFolder(const fs::path& parent) {
  std::string pattern = ((parent.empty() ? fs::temp_directory_path() : parent) / "tetwarp-bench-XXXXXX").string();
  if (!::mkdtemp(pattern.data())) {
    throw Error("no folder can be made, " + pattern + ": " + std::generic_category().message(errno) +
                "; choose another --folder");
  }
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void run_program(const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  int status = ::posix_spawn(&child, argv.front(), nullptr, nullptr, argv.data(), environ);
  if (status == 0 && ::waitpid(child, &status, 0) != child) status = -1;
  if (status != 0) throw Error(arguments.front() + " failed, status " + std::to_string(status));
}

}  // namespace tetwarp::bench
