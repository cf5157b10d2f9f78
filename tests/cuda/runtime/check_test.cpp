// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What a failed call of CUDA says. Needs no device.
#include "cuda/runtime/check.h"

#include <gtest/gtest.h>

namespace tetwarp::cuda_detail {
namespace {

template <class Expected>
std::string said_of(cudaError_t status) {
  try {
    check(status, "cudaMalloc(&all, 7)", "/home/somebody/tetwarp/cuda/owners/claim.cu", 42);
  } catch (const Expected& error) {
    return error.what();
  }
  return "nothing of this kind";
}

TEST(Check, NamesTheCallTheFileAndTheLineButNoFolder) {
  for (const std::string& said :
       {said_of<DeviceError>(cudaErrorInvalidValue), said_of<DeviceMemoryError>(cudaErrorMemoryAllocation)}) {
    EXPECT_NE(said.find("cudaMalloc(&all, 7) at claim.cu:42"), std::string::npos) << said;
    EXPECT_EQ(said.find("somebody"), std::string::npos) << said;
    EXPECT_EQ(said.find('/'), std::string::npos) << said;
  }
  EXPECT_NO_THROW(check(cudaSuccess, "cudaFree(all)", "/home/somebody/claim.cu", 1));
}

}  // namespace
}  // namespace tetwarp::cuda_detail
