#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "apps/console.h"
#include "apps/options.h"

namespace tetwarp::apps {

namespace {

/// Undoes watch_interrupts() for the program that follows: a signal mask outlives exec, the thread that waits does not.
/// @throws Cancelled if an interrupt has been taken already
void release_interrupts() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
  if (interrupt_token().stop_requested()) throw Cancelled();
}

}  // namespace

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
  execv(program.c_str(), argv.data());
  throw Error(program + " cannot be run: " + std::strerror(errno) + "; build or install it again");
}

}  // namespace tetwarp::apps
