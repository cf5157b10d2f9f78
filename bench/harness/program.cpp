// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/program.h"

#include <spawn.h>
#include <sys/wait.h>

#include "deform/errors.h"

extern char** environ;

namespace tetwarp::bench {

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
