// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/harness/floors.h"
#include "bench/io/io_results.h"

namespace tetwarp::bench {

/// Every ratio whose runs are there, of medians.
std::vector<Floor> find_floors(const IoResults& results);

}  // namespace tetwarp::bench
