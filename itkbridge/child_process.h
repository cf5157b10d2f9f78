// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to Tetwarp: programs that run beside this one. This header names nothing of ITK; libraries and programs that
// start a program compile it in.
#include <sys/types.h>

#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace tetwarp {

/// A file descriptor, closed at the end. Programs that are started do not inherit it.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this != &other) {
      close();
      number_ = other.release();
    }
    return *this;
  }

  int number() const { return number_; }
  void close();

 private:
  int release() {
    const int number = number_;
    number_ = -1;
    return number;
  }

  int number_ = -1;
};

struct Pipe {
  Descriptor read, write;
};

/// Makes a pipe. @throws Error where the system gives none
Pipe make_pipe();

/// What a program finds open when it starts: its descriptors 0 to 3 are copies of these, and it has no others. -1
/// stands for /dev/null; `further` is not open at all then.
struct ChildStreams {
  int in = -1;
  int out = -1;
  int error = -1;
  int further = -1;
};

/// A program that runs beside this one. It is started without a copy of this process, which may have other threads that
/// hold locks or a device. No signal is blocked in it, and each does what it does by default.
///
/// It leads a process group of its own. So Ctrl-C at the terminal reaches only this process, which decides what to do,
/// and a script ends together with the programs that it started.
class ChildProcess {
 public:
  /// Starts the program. @throws Error naming the program and the system's reason where it cannot be started
  ChildProcess(const std::filesystem::path& program, std::vector<std::string> arguments, const ChildStreams& streams);
  /// Ends the program if it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Ends the program and its process group at once. Another thread may call it, also while one waits. A program that
  /// has been waited for is left alone.
  void kill();

  /// Waits for the end of the process.
  /// @return the status that waitpid gives; nothing where this process ignores SIGCHLD, or another caller took the
  ///         status
  std::optional<int> wait();

 private:
  /// Guards waited_: once the process was waited for, its id may be that of another process.
  std::mutex mutex_;
  pid_t id_ = -1;
  bool waited_ = false;
};

}  // namespace tetwarp
