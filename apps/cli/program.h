// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

namespace tetwarp::apps {

/// The program: takes over the signals and standard streams of this process, runs the command line, and prints the one
/// line of an error.
/// @return the exit status (docs/reference/exit-status.md)
int run_program(int argc, char** argv);

}  // namespace tetwarp::apps
