// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/devices.h"

#include "cuda/runtime/device_buffer.h"

namespace tetwarp {

bool is_cuda_compiled() { return true; }

int cuda_device_count() {
  int count = 0;
  if (cudaGetDeviceCount(&count) == cudaSuccess) return count;
  cudaGetLastError();
  return 0;
}

void wake_cuda_device(int device) {
  if (cudaSetDevice(device) != cudaSuccess || cudaFree(nullptr) != cudaSuccess) cudaGetLastError();  // told when used
}

void* create_cuda_stream(int device, bool goes_first) {
  const cuda_detail::DeviceScope scope(device);
  cudaStream_t stream = nullptr;
  int last = 0, first = 0;
  TETWARP_CUDA_TRY(cudaDeviceGetStreamPriorityRange(&last, &first));
  TETWARP_CUDA_TRY(cudaStreamCreateWithPriority(&stream, cudaStreamNonBlocking, goes_first ? first : last));
  return stream;
}

void wait_for_cuda_stream(void* stream) { TETWARP_CUDA_TRY(cudaStreamSynchronize(static_cast<cudaStream_t>(stream))); }

void destroy_cuda_stream(void* stream) { cudaStreamDestroy(static_cast<cudaStream_t>(stream)); }

void* allocate_pinned(std::size_t bytes) {
  void* memory = nullptr;
  TETWARP_CUDA_TRY(cudaMallocHost(&memory, bytes));
  return memory;
}

void free_pinned(void* memory) { cudaFreeHost(memory); }

void* allocate_on_device(int device, std::size_t bytes) {
  const cuda_detail::DeviceScope scope(device);
  void* memory = nullptr;
  TETWARP_CUDA_TRY(cudaMalloc(&memory, bytes));
  return memory;
}

void free_on_device(void* memory) { cudaFree(memory); }

void copy_to_device(void* to, const void* from, std::size_t bytes) {
  TETWARP_CUDA_TRY(cudaMemcpy(to, from, bytes, cudaMemcpyHostToDevice));
}

std::string describe_cuda_device(int device) {
  cudaDeviceProp properties{};
  TETWARP_CUDA_TRY(cudaGetDeviceProperties(&properties, device));
  return std::string(properties.name) + ", " + std::to_string(properties.totalGlobalMem / 1000000000) + " GB";
}

}  // namespace tetwarp
