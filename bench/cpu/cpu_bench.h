// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <string>

#include "bench/cpu/cpu_results.h"

namespace tetwarp::bench {

/// Measures what the options ask for.
///
/// @param say  is told of every step, one line
/// @throws InputError
CpuResults measure_cpu(const CpuOptions& options, const std::function<void(const std::string&)>& say);

}  // namespace tetwarp::bench
