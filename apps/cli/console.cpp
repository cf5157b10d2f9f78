// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/console.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <thread>

#include "io/shown_text.h"
#include "io/staged_output.h"

namespace tetwarp::apps {

namespace {

std::stop_source& interrupts() {
  static std::stop_source source;
  return source;
}

constexpr int kBarWidth = 30;

/// What people, terminals, shells and queues of clusters end a program with. Without a handler each of them would end
/// it where it stands, and unfinished outputs would stay.
constexpr int kInterrupts[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU, SIGUSR1, SIGUSR2, SIGALRM};

volatile std::sig_atomic_t reader_is_gone = 0;

bool prints_filter_progress = false;

bool is_ignored(int signal) {
  struct sigaction action {};
  return sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

/// A hangup under nohup, and what else the caller has had ignored, stays ignored. Ctrl-C and TERM always count, for
/// they are ignored in every job that a shell has put into the background.
sigset_t watched_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : kInterrupts) {
    if (signal == SIGINT || signal == SIGTERM || !is_ignored(signal)) sigaddset(&signals, signal);
  }
  return signals;
}

}  // namespace

void watch_interrupts() {
  static const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // every later thread inherits the mask; one thread waits
  std::thread([] {
    int received = 0;
    sigwait(&signals, &received);
    interrupts().request_stop();
    sigwait(&signals, &received);
    remove_unfinished_outputs();
    _exit(128 + received);
  }).detach();
  struct sigaction broken_pipe {};  // a handler, for to ignore a signal would pass on to programs that are run
  broken_pipe.sa_handler = [](int) { reader_is_gone = 1; };
  broken_pipe.sa_flags = SA_RESTART;
  if (!is_ignored(SIGPIPE)) sigaction(SIGPIPE, &broken_pipe, nullptr);
}

void release_interrupts() {
  const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

void hold_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // The system gives a new file the lowest free number, which is this one. A standard input that can only be written,
    // and outputs that can only be read, fail as closed ones do.
    if (::fcntl(stream, F_GETFD) < 0) ::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

void end_with_reader() {
  if (!reader_is_gone) return;
  std::signal(SIGPIPE, SIG_DFL);
  std::raise(SIGPIPE);
}

std::stop_token interrupt_token() { return interrupts().get_token(); }

void say(const CommonOptions& common, const std::string& line) {
  if (!common.quiet) std::fprintf(stderr, "%s\n", shown_lines(line).c_str());
}

void print_filter_progress() { prints_filter_progress = true; }

Stage::Stage(const CommonOptions& common, std::string name)
    : common_(common), name_(std::move(name)), terminal_(isatty(STDERR_FILENO) != 0) {
  if (!prints_filter_progress) return;
  std::printf("<filter-start><filter-name>%s</filter-name></filter-start>\n", name_.c_str());
  std::fflush(stdout);
}

Stage::~Stage() {
  if (prints_filter_progress) {
    if (std::uncaught_exceptions() == 0) std::printf("<filter-progress>1</filter-progress>\n");
    std::printf("<filter-end><filter-name>%s</filter-name><filter-time>%.3f</filter-time></filter-end>\n",
                name_.c_str(), seconds());
    std::fflush(stdout);
  }
  if (visible_) std::fprintf(stderr, "\r\033[K");
  if (common_.verbose) say(common_, name_ + ": " + std::to_string(seconds()) + " s");
}

Control Stage::control() {
  return {.progress = [this](double fraction) { prints_filter_progress ? print(fraction) : draw(fraction); },
          .stop = interrupt_token()};
}

double Stage::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void Stage::draw(double fraction) {
  using namespace std::chrono_literals;
  const auto now = std::chrono::steady_clock::now();
  if (common_.quiet || !terminal_ || now - start_ < 1s || now - drawn_ < 100ms) return;
  drawn_ = now;
  visible_ = true;
  const int filled = static_cast<int>(fraction * kBarWidth);
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(kBarWidth - filled), '.');
  std::fprintf(stderr, "\r%-10s [%s] %3d %%", name_.c_str(), bar.c_str(), static_cast<int>(fraction * 100));
  std::fflush(stderr);
}

void Stage::print(double fraction) {
  using namespace std::chrono_literals;
  const auto now = std::chrono::steady_clock::now();
  if (now - drawn_ < 100ms) return;
  drawn_ = now;
  std::printf("<filter-progress>%.3f</filter-progress>\n", fraction);
  std::fflush(stdout);
}

std::string format_bytes(std::uint64_t bytes) {
  char text[32];
  if (bytes >= 1000000000) {
    std::snprintf(text, sizeof text, "%.2f GB", static_cast<double>(bytes) * 1e-9);
  } else {
    std::snprintf(text, sizeof text, "%.0f MB", static_cast<double>(bytes) * 1e-6);
  }
  return text;
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace tetwarp::apps
