// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/floors.h"
#include "bench/gpu_results.h"

namespace tetwarp::bench {

/// Every ratio whose runs are there, of medians. "New field" counts set_field, "resample" does not.
std::vector<Floor> find_floors(const GpuResults& results);

}  // namespace tetwarp::bench
