// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <string>

#include "bench/invert/invert_results.h"

namespace tetwarp::bench {

/// Measures what the options ask for.
///
/// @param say  is told of every run, one line
/// @throws InputError
InvertResults measure_invert(const InvertOptions& options, const std::function<void(const std::string&)>& say);

}  // namespace tetwarp::bench
