// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/harness/results.h"

namespace tetwarp::bench {

/// printf into a string, at most 511 characters.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// "median (q1-q3)"; "-" for none.
std::string cell(const std::optional<Summary>& ms);
/// Two decimals; "-" for none.
std::string cell(const std::optional<double>& ratio);

/// One line of a table.
std::string row(const std::vector<std::string>& cells);
/// Its first two lines.
std::string heading(const std::vector<std::string>& names);

/// Device, driver and runtime, "NVIDIA H200, compute capability 9.0, driver 580.95.05, runtime 13.0".
std::string cuda_text(const Machine& machine);

}  // namespace tetwarp::bench
