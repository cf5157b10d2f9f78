// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/runtime/device_buffer.h"

namespace tetwarp::cuda_detail {

/// Brings a value to the host, after what is queued on a stream.
/// @param place  where it lies in the device's memory
/// @param room   where it is received
template <class T>
T fetch(const void* place, PinnedBuffer<T>& room, cudaStream_t stream) {
  T* const found = room.reserve(1);
  TETWARP_CUDA_TRY(cudaMemcpyAsync(found, place, sizeof *found, cudaMemcpyDeviceToHost, stream));
  TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  return *found;
}

}  // namespace tetwarp::cuda_detail
