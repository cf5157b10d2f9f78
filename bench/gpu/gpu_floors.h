// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/gpu/gpu_results.h"
#include "bench/harness/floors.h"

namespace tetwarp::bench {

/// Every ratio whose runs are there, of medians. "New field" counts set_field, "resample" does not.
std::vector<Floor> find_floors(const GpuResults& results);

}  // namespace tetwarp::bench
