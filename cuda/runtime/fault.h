// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// For tests of what becomes of work when a device fails; no device fails on demand.
#include <cuda_runtime.h>

namespace tetwarp::cuda_detail {

/// Whether the environment variable TETWARP_CUDA_FAULT is set:
///     memory@N     the Nth checked call of the process, from 1, finds no memory
///     no-memory@N  all calls that allocate find none, from the Nth checked call on
///     lost@N       the device that is current at the Nth checked call fails there, and in all calls after it
extern const bool kFaultsAreInjected;

/// What a call that succeeded is taken to have returned.
cudaError_t injected_fault(const char* call);

}  // namespace tetwarp::cuda_detail
