// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/gpu/gpu_parts.h"
#include "bench/harness/results.h"

namespace tetwarp::bench {

/// With the floors that a copy at this speed sets: "volume_floor_ms", source and output, for a copy reads the one and
/// writes the other; "bytes_floor_ms", source, field and output, for a copy reads and writes and a field is read only.
Json copies_json(const Samples& copies);
Json memory_json(const std::string& field, const MemoryUse& use);

/// Every ratio whose runs are there, of medians. "New field" counts set_field, "resample" does not.
Floors find_gpu_floors(const Json& document);

}  // namespace tetwarp::bench
