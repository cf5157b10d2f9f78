// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "apps/cli/console.h"
#include "apps/cli/options.h"

namespace tetwarp::apps {

int run_bench(const std::vector<std::string>& arguments) {
  // The kernel has followed the symbolic links of this path.
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const std::string program = (folder / "tetwarp-bench").string();
  if (!std::filesystem::exists(program)) {
    throw Error("no program tetwarp-bench in " + folder.string() +
                ", where tetwarp lies; build it with -DTETWARP_BUILD_BENCH=ON");
  }
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};  // execv takes char* const* and writes nothing
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  release_interrupts();
  if (interrupt_token().stop_requested()) throw Cancelled();
  execv(program.c_str(), argv.data());
  throw Error(program + " cannot be run: " + std::strerror(errno) + "; build or install it again");
}

}  // namespace tetwarp::apps
