// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "cuda/runtime/check.h"
#include "deform/volume.h"

namespace tetwarp::cuda_detail {

/// Checks that a pointer is in the memory that its view names: a kernel that reads host memory would end the context.
/// Null is left to other checks. @throws InputError
inline void require_memory(const void* pointer, Memory memory, const std::string& name) {
  if (!pointer) return;
  cudaPointerAttributes found{};
  TETWARP_CUDA_TRY(cudaPointerGetAttributes(&found, pointer));
  const bool on_device = found.type == cudaMemoryTypeDevice || found.type == cudaMemoryTypeManaged;
  if (memory == Memory::host) {
    require(found.type != cudaMemoryTypeDevice, name + " is in device memory, its view says host");
    return;
  }
  int device = 0;
  TETWARP_CUDA_TRY(cudaGetDevice(&device));
  require(on_device, name + " is in host memory, its view says device");
  require(found.type == cudaMemoryTypeManaged || found.device == device,
          name + " is on device " + std::to_string(found.device) + ", the resampler works on device " +
              std::to_string(device));
}

}  // namespace tetwarp::cuda_detail
