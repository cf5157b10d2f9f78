#include "cuda/devices.h"

#include "cuda/check.h"

namespace tetwarp {

bool has_cuda() { return true; }

int cuda_device_count() {
  int count = 0;
  if (cudaGetDeviceCount(&count) == cudaSuccess) return count;
  cudaGetLastError();
  return 0;
}

void wake_cuda_device(int device) {
  if (cudaSetDevice(device) != cudaSuccess || cudaFree(nullptr) != cudaSuccess) cudaGetLastError();  // told when used
}

std::string describe_cuda_device(int device) {
  cudaDeviceProp properties{};
  TETWARP_CUDA_TRY(cudaGetDeviceProperties(&properties, device));
  return std::string(properties.name) + ", " + std::to_string(properties.totalGlobalMem / 1000000000) + " GB";
}

}  // namespace tetwarp
