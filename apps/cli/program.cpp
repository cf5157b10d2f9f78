// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/program.h"

#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>

#include "apps/cli/console.h"
#include "apps/cli/options.h"
#include "io/opened_file.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

constexpr int kFailed = 1, kWrongCommandLine = 2, kInputRefused = 4, kInterrupted = 130;

int fail(int status, const char* what) {
  std::fprintf(stderr, "tetwarp: error: %s\n", shown_lines(what).c_str());
  return status;
}

}  // namespace

int run_program(int argc, char** argv) {
  hold_closed_streams();
  try {
    watch_interrupts();
    std::signal(SIGCHLD, SIG_DFL);  // how ffmpeg ended is to be known, whatever the caller ignores
    std::signal(SIGXFSZ, SIG_IGN);  // a file that would be larger than allowed is an error like a full disk
    const int status = run_command_line(argc, argv);
    std::cout.flush();
    if (std::fflush(stdout) != 0 || std::ferror(stdout) || !std::cout) {
      end_with_reader();
      throw Error("standard output cannot be written; is the disk full?");
    }
    return status;
  } catch (const UsageError& error) {
    return fail(kWrongCommandLine, error.what());
  } catch (const InputError& error) {
    return fail(kInputRefused, error.what());
  } catch (const Cancelled&) {
    return fail(kInterrupted, "interrupted; nothing was written");
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(kInputRefused, message_of(error).c_str());
  } catch (const std::bad_alloc&) {
    return fail(kFailed, "not enough memory; try a larger --cell-size, or see --dry-run for what is needed");
  } catch (const std::exception& error) {
    return fail(kFailed, error.what());
  }
}

}  // namespace tetwarp::apps
