// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <fstream>
#include <sstream>

#include "bench/paper/backend.h"
#include "cuda/runtime/check.h"

namespace tetwarp::bench {

namespace {

/// 13000 -> "13.0".
std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

/// "580.95.05" of "NVRM version: NVIDIA UNIX ... Kernel Module ...  580.95.05  ..."; the first word of digits and dots.
/// Empty where the system does not say.
std::string kernel_module_version() {
  std::ifstream file("/proc/driver/nvidia/version");
  std::string line, word;
  std::getline(file, line);
  std::istringstream words(line);
  while (words >> word) {
    if (word.find('.') != std::string::npos && word.find_first_not_of("0123456789.") == std::string::npos) return word;
  }
  return {};
}

}  // namespace

CudaFacts describe_cuda(int device) {
  cudaDeviceProp properties{};
  TETWARP_CUDA_TRY(cudaGetDeviceProperties(&properties, device));
  int runtime = 0, driver = 0;
  TETWARP_CUDA_TRY(cudaRuntimeGetVersion(&runtime));
  TETWARP_CUDA_TRY(cudaDriverGetVersion(&driver));
  const std::string module = kernel_module_version();
  return {properties.name, module.empty() ? "CUDA " + version_text(driver) : module, version_text(runtime),
          std::to_string(properties.major) + "." + std::to_string(properties.minor)};
}

}  // namespace tetwarp::bench
