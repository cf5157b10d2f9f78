// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/harness/floors.h"
#include "bench/invert/invert_results.h"

namespace tetwarp::bench {

/// What was measured of what Tetwarp's inverse is held to.
std::vector<Floor> find_floors(const InvertResults& results);

}  // namespace tetwarp::bench
