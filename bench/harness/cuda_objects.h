// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cuda_runtime.h>

#include <cstdint>

#include "cuda/runtime/check.h"
#include "deform/core/host_device.h"

namespace tetwarp::bench {

class Stream {
 public:
  explicit Stream(unsigned flags = cudaStreamDefault) { TETWARP_CUDA_TRY(cudaStreamCreateWithFlags(&stream_, flags)); }
  ~Stream() { cudaStreamDestroy(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  cudaStream_t get() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

/// A point of time on a stream.
class Event {
 public:
  Event() { TETWARP_CUDA_TRY(cudaEventCreate(&event_)); }
  ~Event() { cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  void record(const Stream& stream) { TETWARP_CUDA_TRY(cudaEventRecord(event_, stream.get())); }
  /// What is queued on a stream from now on waits for this event.
  void hold_up(const Stream& stream) const { TETWARP_CUDA_TRY(cudaStreamWaitEvent(stream.get(), event_)); }
  /// Waits for this event, then gives the time since an earlier one.
  double ms_since(const Event& earlier) const {
    TETWARP_CUDA_TRY(cudaEventSynchronize(event_));
    float ms = 0;
    TETWARP_CUDA_TRY(cudaEventElapsedTime(&ms, earlier.event_, event_));
    return ms;
  }

 private:
  cudaEvent_t event_ = nullptr;
};

/// A 3-D array of int16 and a texture on it: linear, clamped, values read as -1 to 1 (the paper's).
class Texture {
 public:
  explicit Texture(const glm::ivec3& size)
      : extent_{static_cast<std::size_t>(size.x), static_cast<std::size_t>(size.y), static_cast<std::size_t>(size.z)} {
    const cudaChannelFormatDesc channel = cudaCreateChannelDesc<short>();
    TETWARP_CUDA_TRY(cudaMalloc3DArray(&array_, &channel, extent_));
    cudaResourceDesc resource{};
    resource.resType = cudaResourceTypeArray;
    resource.res.array.array = array_;
    cudaTextureDesc texture{};
    for (cudaTextureAddressMode& mode : texture.addressMode) mode = cudaAddressModeClamp;
    texture.filterMode = cudaFilterModeLinear;
    texture.readMode = cudaReadModeNormalizedFloat;
    texture.normalizedCoords = 0;
    const cudaError_t made = cudaCreateTextureObject(&object_, &resource, &texture, nullptr);
    if (made != cudaSuccess) cudaFreeArray(array_);
    TETWARP_CUDA_TRY(made);
  }
  ~Texture() {
    cudaDestroyTextureObject(object_);
    cudaFreeArray(array_);
  }
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;

  cudaTextureObject_t object() const { return object_; }

  /// Copies a whole volume, i fastest; done when it returns.
  void upload(const std::int16_t* voxels, cudaStream_t stream) {
    cudaMemcpy3DParms copy{};
    copy.srcPtr = make_cudaPitchedPtr(const_cast<std::int16_t*>(voxels), extent_.width * sizeof(std::int16_t),
                                      extent_.width, extent_.height);
    copy.dstArray = array_;
    copy.extent = extent_;
    copy.kind = cudaMemcpyHostToDevice;
    TETWARP_CUDA_TRY(cudaMemcpy3DAsync(&copy, stream));
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  }

 private:
  cudaExtent extent_;
  cudaArray_t array_ = nullptr;
  cudaTextureObject_t object_ = 0;
};

}  // namespace tetwarp::bench
