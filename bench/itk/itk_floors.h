// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/harness/floors.h"
#include "bench/itk/itk_results.h"

namespace tetwarp::bench {

/// Our run of the same task and field; null where there is none.
const ItkRun* find_own(const ItkResults& results, const ItkRun& like);

/// Times and errors of ITK's filters over ours, and what streams may not do: write other bytes, or need as much memory.
std::vector<Floor> find_floors(const ItkResults& results);

}  // namespace tetwarp::bench
