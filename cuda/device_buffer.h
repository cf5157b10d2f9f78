#pragma once

#include <cstddef>
#include <utility>

#include "cuda/check.h"

namespace tetwarp::cuda_detail {

/// Owner of device memory for `size` elements; it only grows, so repeated sizes allocate nothing.
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
      cudaFree(std::exchange(data_, nullptr));
      size_ = 0;
      TETWARP_CUDA_TRY(cudaMalloc(&data_, size * sizeof(T)));
      size_ = size;
    }
    return data_;
  }
  T* data() const { return data_; }

  void upload(const T* host, std::size_t size) {
    reserve(size);
    TETWARP_CUDA_TRY(cudaMemcpy(data_, host, size * sizeof(T), cudaMemcpyHostToDevice));
  }
  void download(T* host, std::size_t size) const {
    TETWARP_CUDA_TRY(cudaMemcpy(host, data_, size * sizeof(T), cudaMemcpyDeviceToHost));
  }
  /// Sets every byte of the first `size` elements.
  void fill(int byte, std::size_t size) { TETWARP_CUDA_TRY(cudaMemset(reserve(size), byte, size * sizeof(T))); }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Makes a device the current one of this thread, and the former one again at the end.
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
