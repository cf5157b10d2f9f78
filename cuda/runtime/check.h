// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cuda_runtime.h>

#include <string>
#include <string_view>

#include "cuda/runtime/fault.h"
#include "deform/errors.h"

/// Throws DeviceError, or DeviceMemoryError, unless a CUDA call succeeded. It names the call, the line and the file,
/// but not the folder of whoever built the program.
#define TETWARP_CUDA_TRY(call) ::tetwarp::cuda_detail::check((call), #call, __FILE__, __LINE__)

namespace tetwarp::cuda_detail {

inline void check(cudaError_t status, const char* call, std::string_view file, int line) {
  if (status == cudaSuccess && kFaultsAreInjected) status = injected_fault(call);
  if (status == cudaSuccess) return;
  cudaGetLastError();  // clears what is not sticky
  const std::string name(file.substr(file.find_last_of('/') + 1));
  const std::string what = std::string("CUDA: ") + cudaGetErrorString(status) + ", " + call + " at " + name + ":" +
                           std::to_string(line) + "; use --backend cpu, the bits are the same";
  if (status == cudaErrorMemoryAllocation) throw DeviceMemoryError(what);
  throw DeviceError(what);
}

}  // namespace tetwarp::cuda_detail
