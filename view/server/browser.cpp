// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/server/browser.h"

#include <fcntl.h>
#include <pwd.h>
#include <spawn.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>

extern char** environ;

namespace tetwarp::viewer {

namespace fs = std::filesystem;

namespace {

/// Starts a program with one argument, and does not wait for it. Its output goes nowhere.
bool start(const char* program, const std::string& argument) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);  // signals that this program waits for reach the browser
  posix_spawnattr_setpgroup(&attributes, 0);       // Ctrl-C ends this program, not the browser
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  std::string name = program, word = argument;
  char* const words[] = {name.data(), word.data(), nullptr};
  pid_t process = 0;
  const bool started = posix_spawnp(&process, program, &actions, &attributes, words, environ) == 0;
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return started;
}

}  // namespace

bool has_desktop() { return std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY"); }

bool came_by_ssh() { return std::getenv("SSH_CONNECTION"); }

Browser::Browser(const std::string& address) {
  if (!has_desktop()) return;
  std::error_code error;
  std::string name = (fs::temp_directory_path(error) / "tetwarp-view-XXXXXX").string();
  if (error || !mkdtemp(name.data())) return;  // of mode 0700
  folder_ = name;
  const fs::path file = folder_ / "open.html";
  std::ofstream(file) << "<!doctype html><meta charset=\"utf-8\"><title>Tetwarp</title>"
                         "<meta http-equiv=\"refresh\" content=\"0;url="
                      << address << "\"><a href=\"" << address << "\">Open the viewer</a>\n";
  const char* const chosen = std::getenv("BROWSER");
  is_open_ = (chosen && *chosen && start(chosen, file.string())) || start("xdg-open", file.string());
}

Browser::~Browser() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

std::string forwarding_command(int port) {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  const passwd* const user = getpwuid(geteuid());
  const std::string number = std::to_string(port);
  return "ssh -N -L " + number + ":127.0.0.1:" + number + " " + (user ? std::string(user->pw_name) + "@" : "") +
         host.data();
}

}  // namespace tetwarp::viewer
