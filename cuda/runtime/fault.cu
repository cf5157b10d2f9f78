// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/runtime/fault.h"

#include <atomic>
#include <charconv>
#include <cstdlib>
#include <string_view>

namespace tetwarp::cuda_detail {

namespace {

struct Fault {
  std::string_view kind;
  long at = 0;
};

Fault wanted_fault() {
  const char* const text = std::getenv("TETWARP_CUDA_FAULT");
  const std::string_view words = text ? text : "";
  const std::size_t split = words.find('@');
  if (split == std::string_view::npos) return {};
  Fault fault{words.substr(0, split)};
  std::from_chars(words.data() + split + 1, words.data() + words.size(), fault.at);
  return fault;
}

const Fault kFault = wanted_fault();
std::atomic<long> calls = 0;
std::atomic<int> lost_device = -1;

}  // namespace

const bool kFaultsAreInjected = kFault.at > 0;

cudaError_t injected_fault(const char* call) {
  const long number = ++calls;
  if (kFault.kind == "memory") return number == kFault.at ? cudaErrorMemoryAllocation : cudaSuccess;
  if (number < kFault.at) return cudaSuccess;
  if (kFault.kind == "no-memory")
    return std::string_view(call).starts_with("cudaMalloc") ? cudaErrorMemoryAllocation : cudaSuccess;
  if (kFault.kind != "lost") return cudaSuccess;
  int device = 0;
  cudaGetDevice(&device);
  int none = -1;
  lost_device.compare_exchange_strong(none, device);
  return lost_device == device ? cudaErrorDevicesUnavailable : cudaSuccess;
}

}  // namespace tetwarp::cuda_detail
