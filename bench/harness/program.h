// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

namespace tetwarp::bench {

/// Runs a program to its end, with this program's environment and standard streams.
/// @param arguments  the first is the program's path
/// @throws Error when it cannot be run or fails
void run_program(const std::vector<std::string>& arguments);

}  // namespace tetwarp::bench
