#pragma once

#include <cuda_runtime.h>

#include <string>

#include "deform/errors.h"

/// Throws DeviceError, naming the call, file and line, unless a CUDA call succeeded.
#define TETWARP_CUDA_TRY(call) ::tetwarp::cuda_detail::check((call), #call, __FILE__, __LINE__)

namespace tetwarp::cuda_detail {

inline void check(cudaError_t status, const char* call, const char* file, int line) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // clears what is not sticky
  throw DeviceError(std::string("CUDA: ") + cudaGetErrorString(status) + ", " + call + " at " + file + ":" +
                    std::to_string(line) + "; use --backend cpu, the bits are the same");
}

}  // namespace tetwarp::cuda_detail
