// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>

#include "deform/errors.h"

namespace tetwarp {
namespace {

constexpr int kStreams = 4;

std::string reason(int error) { return std::generic_category().message(error); }

/// A copy of a descriptor with a number above those that a program is given, so that it is not overwritten before it is
/// copied to its place.
Descriptor raised(int number) {
  if (number < 0) return {};
  const int copy = ::fcntl(number, F_DUPFD_CLOEXEC, kStreams);
  if (copy < 0) throw Error("no file can be opened for another program: " + reason(errno) + "; see ulimit -n");
  return Descriptor(copy);
}

/// The list of what is done to descriptors when a program starts.
class Actions {
 public:
  explicit Actions(const Descriptor (&streams)[kStreams]) {
    posix_spawn_file_actions_init(&actions_);
    for (int n = 0; n < kStreams; ++n) {
      if (streams[n].number() >= 0)
        posix_spawn_file_actions_adddup2(&actions_, streams[n].number(), n);
      else if (n <= STDERR_FILENO)
        posix_spawn_file_actions_addopen(&actions_, n, "/dev/null", n == STDIN_FILENO ? O_RDONLY : O_WRONLY, 0);
    }
    // Closes all others: a program that uses this library may have files that exec does not close.
    posix_spawn_file_actions_addclosefrom_np(&actions_, streams[kStreams - 1].number() >= 0 ? kStreams : kStreams - 1);
  }
  ~Actions() { posix_spawn_file_actions_destroy(&actions_); }
  Actions(const Actions&) = delete;
  Actions& operator=(const Actions&) = delete;
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

/// Attributes of a program that starts: default signals, and a process group of its own.
class Attributes {
 public:
  Attributes() {
    posix_spawnattr_init(&attributes_);
    sigset_t signals;
    sigemptyset(&signals);
    posix_spawnattr_setsigmask(&attributes_, &signals);
    sigfillset(&signals);
    posix_spawnattr_setsigdefault(&attributes_, &signals);
    posix_spawnattr_setpgroup(&attributes_, 0);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  }
  ~Attributes() { posix_spawnattr_destroy(&attributes_); }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;
  const posix_spawnattr_t* get() const { return &attributes_; }

 private:
  posix_spawnattr_t attributes_;
};

}  // namespace

void Descriptor::close() {
  if (number_ >= 0) ::close(release());
}

Pipe make_pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    throw Error("no pipe to another program can be opened: " + reason(errno) + "; see ulimit -n");
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

ChildProcess::ChildProcess(const std::filesystem::path& program, std::vector<std::string> arguments,
                           const ChildStreams& streams) {
  const Descriptor sources[kStreams] = {raised(streams.in), raised(streams.out), raised(streams.error),
                                        raised(streams.further)};
  arguments.insert(arguments.begin(), program.string());
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const Actions actions(sources);
  const Attributes attributes;
  const int error = ::posix_spawn(&id_, program.c_str(), actions.get(), attributes.get(), argv.data(), environ);
  if (error != 0) throw Error("the program " + program.string() + " cannot be started: " + reason(error));
}

ChildProcess::~ChildProcess() {
  if (waited_) return;
  kill();
  wait();
}

void ChildProcess::kill() {
  const std::lock_guard lock(mutex_);
  if (!waited_) ::kill(-id_, SIGKILL);
}

std::optional<int> ChildProcess::wait() {
  siginfo_t ended{};  // waits without freeing the process id, which kill() may still use
  while (::waitid(P_PID, static_cast<id_t>(id_), &ended, WEXITED | WNOWAIT) != 0 && errno == EINTR) continue;
  const std::lock_guard lock(mutex_);
  waited_ = true;
  int status = 0;
  pid_t done = 0;
  do done = ::waitpid(id_, &status, 0);
  while (done < 0 && errno == EINTR);
  if (done != id_) return std::nullopt;
  return status;
}

}  // namespace tetwarp
