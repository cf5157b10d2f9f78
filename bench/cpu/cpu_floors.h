// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/cpu/cpu_results.h"
#include "bench/harness/floors.h"

namespace tetwarp::bench {

/// Every ratio whose runs are there, of medians. "New field" counts set_field, "resample" does not; "bytes" is moving
/// field, source and output once.
std::vector<Floor> find_floors(const CpuResults& results);

}  // namespace tetwarp::bench
