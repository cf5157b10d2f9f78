// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>

namespace tetwarp::viewer {

/// A browser that is opened on an address with a secret. It is given a file that only this user can read and that leads
/// to the address, so that no list of processes shows the secret. The file goes with this object.
class Browser {
 public:
  /// Opens the browser of this desktop, if there is one.
  explicit Browser(const std::string& address);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;
  /// Whether a browser was started.
  bool is_open() const { return is_open_; }

 private:
  std::filesystem::path folder_;
  bool is_open_ = false;
};

/// Whether this machine has a desktop on which a browser could be opened.
bool has_desktop();
/// Whether the user sits at another machine, from which ssh leads here.
bool came_by_ssh();

/// How to reach a port of this machine from the one at which the user sits: the command of ssh.
std::string forwarding_command(int port);

}  // namespace tetwarp::viewer
