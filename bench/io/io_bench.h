// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>

#include "bench/io/io_results.h"

namespace tetwarp::bench {

/// Writes a phantom series and recoded copies of it into `folder`, which exists and is empty, and measures what the
/// options ask for; `machine` is left to the caller. Before the timing every reader must have given the same voxels.
///
/// @param say  is told of every step, one line
/// @throws Error, InputError
IoResults measure_io(const IoOptions& options, const std::filesystem::path& folder,
                     const std::function<void(const std::string&)>& say);

}  // namespace tetwarp::bench
