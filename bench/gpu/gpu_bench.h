// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <string>

#include "bench/gpu/gpu_results.h"

namespace tetwarp::bench {

/// Measures what the options ask for; `machine` and `input_kind` are left to the caller.
///
/// @param say  is told of every step, one line
/// @throws InputError, DeviceError, NotCompiled
GpuResults measure_gpu(const GpuOptions& options, const std::function<void(const std::string&)>& say);

}  // namespace tetwarp::bench
