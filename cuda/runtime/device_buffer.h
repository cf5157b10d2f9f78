// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <utility>

#include "cuda/runtime/check.h"

namespace tetwarp::cuda_detail {

/// Owner of device memory for `size` elements; it only grows, so repeated sizes allocate nothing.
///
/// Copies and fills are queued on a stream. `upload` from pageable memory and `download` have read or written the host
/// when they return.
template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  ~DeviceBuffer() { cudaFree(data_); }
  DeviceBuffer(const DeviceBuffer&) = delete;
  DeviceBuffer& operator=(const DeviceBuffer&) = delete;

  /// Room for at least `size` elements; what was there may be lost. @throws DeviceError
  T* reserve(std::size_t size) {
    if (size > size_) {
      release();
      TETWARP_CUDA_TRY(cudaMalloc(&data_, size * sizeof(T)));
      size_ = size;
    }
    return data_;
  }
  /// As `reserve`, where the device has the memory. @return whether it has
  bool try_reserve(std::size_t size) {
    if (size <= size_) return true;
    release();
    if (cudaMalloc(&data_, size * sizeof(T)) == cudaSuccess) {
      size_ = size;
      return true;
    }
    data_ = nullptr;
    cudaGetLastError();  // an allocation that fails leaves the device as it was
    return false;
  }
  T* data() const { return data_; }
  /// Elements that there is room for.
  std::size_t capacity() const { return size_; }
  /// Gives the memory back.
  void release() {
    cudaFree(std::exchange(data_, nullptr));
    size_ = 0;
  }

  void upload(const T* host, std::size_t size, cudaStream_t stream) {
    reserve(size);
    TETWARP_CUDA_TRY(cudaMemcpyAsync(data_, host, size * sizeof(T), cudaMemcpyHostToDevice, stream));
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  }
  void download(T* host, std::size_t size, cudaStream_t stream) const {
    TETWARP_CUDA_TRY(cudaMemcpyAsync(host, data_, size * sizeof(T), cudaMemcpyDeviceToHost, stream));
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  }
  /// Sets every byte of the first `size` elements.
  void fill(int byte, std::size_t size, cudaStream_t stream) {
    TETWARP_CUDA_TRY(cudaMemsetAsync(reserve(size), byte, size * sizeof(T), stream));
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Owner of pinned host memory, which copies may fill while the host goes on; it only grows.
template <class T>
class PinnedBuffer {
 public:
  PinnedBuffer() = default;
  ~PinnedBuffer() { cudaFreeHost(data_); }
  PinnedBuffer(const PinnedBuffer&) = delete;
  PinnedBuffer& operator=(const PinnedBuffer&) = delete;

  /// Room for at least `size` elements; what was there may be lost. @throws DeviceError
  T* reserve(std::size_t size) {
    if (size > size_) {
      cudaFreeHost(std::exchange(data_, nullptr));
      size_ = 0;
      TETWARP_CUDA_TRY(cudaMallocHost(&data_, size * sizeof(T)));
      size_ = size;
    }
    return data_;
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Makes a device the current one of this thread, and at the end the one that was current before.
class DeviceScope {
 public:
  explicit DeviceScope(int device) {
    TETWARP_CUDA_TRY(cudaGetDevice(&before_));
    TETWARP_CUDA_TRY(cudaSetDevice(device));
  }
  ~DeviceScope() { cudaSetDevice(before_); }
  DeviceScope(const DeviceScope&) = delete;
  DeviceScope& operator=(const DeviceScope&) = delete;

 private:
  int before_ = 0;
};

}  // namespace tetwarp::cuda_detail
