// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/harness/results.h"

namespace tetwarp::bench {

/// @param device  of CUDA; -1: none is used. @param threads  0: all
Machine describe_machine(int device, int threads);

/// Bytes of memory that programs may take without swapping (/proc/meminfo, MemAvailable); the largest number where that
/// is not known.
std::uint64_t available_bytes();

}  // namespace tetwarp::bench
