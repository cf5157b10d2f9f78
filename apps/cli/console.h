// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <stop_token>
#include <string>

#include "apps/cli/options.h"

namespace tetwarp::apps {

/// Takes the numbers of standard streams that the caller has closed, so that no file that is opened gets one: messages
/// would go into it. To be called first. Whoever reads or writes such a stream fails, as
/// with a closed one.
void hold_closed_streams();

/// Turns what ends a program from outside (Ctrl-C, TERM, a hangup, Ctrl-\, a limit of time, USR1 and the like) into a
/// stop request, so that partial outputs are removed; a second one ends the process at once. A reader of standard
/// output or standard error that goes away stops nothing.
void watch_interrupts();
/// Lets all of them through again, for a program that follows this one: a signal mask outlives exec.
void release_interrupts();
/// Ends the process by SIGPIPE, as other programs are, where the reader of what it printed has gone; else returns.
void end_with_reader();
std::stop_token interrupt_token();

/// One line to standard error, unless quiet.
void say(const CommonOptions& common, const std::string& line);

/// Stages of this process tell their progress on standard output from now on, in the elements of the Slicer Execution
/// Model (filter-start, filter-progress, filter-end), instead of drawing bars.
void print_filter_progress();

/// A stage of a command: its time, and a progress bar on a terminal once it lasts longer than a second.
class Stage {
 public:
  Stage(const CommonOptions& common, std::string name);
  ~Stage();
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// For calls that report progress and can be cancelled. Refers to this stage.
  Control control();
  double seconds() const;

 private:
  void draw(double fraction);
  void print(double fraction);

  const CommonOptions& common_;
  std::string name_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), drawn_ = start_;
  bool terminal_, visible_ = false;
};

/// "1.2 GB".
std::string format_bytes(std::uint64_t bytes);

/// Largest memory this process has held so far.
std::uint64_t peak_memory_bytes();

}  // namespace tetwarp::apps
