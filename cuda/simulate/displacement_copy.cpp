// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>

#include "cuda/factories.h"
#include "cuda/runtime/device_buffer.h"

namespace tetwarp::simulate {

namespace {

using cuda_detail::DeviceBuffer;
using cuda_detail::DeviceScope;

class CudaCopy final : public DisplacementCopy {
 public:
  explicit CudaCopy(int device) : device_(device) {}

  void take(std::span<const glm::vec3> displacement, void* stream) override {
    const DeviceScope here(device_);
    const auto queue = static_cast<cudaStream_t>(stream);
    size_ = displacement.size();
    TETWARP_CUDA_TRY(cudaMemcpyAsync(held_.reserve(size_), displacement.data(), displacement.size_bytes(),
                                     cudaMemcpyDeviceToDevice, queue));
    TETWARP_CUDA_TRY(cudaStreamSynchronize(queue));
  }
  std::span<glm::vec3> values() override { return {held_.data(), size_}; }
  Memory memory() const override { return Memory::device; }
  std::vector<glm::vec3> on_host() const override {
    const DeviceScope here(device_);
    std::vector<glm::vec3> result(size_);
    held_.download(result.data(), size_, nullptr);
    return result;
  }

 private:
  int device_;
  std::size_t size_ = 0;
  DeviceBuffer<glm::vec3> held_;
};

}  // namespace

std::unique_ptr<DisplacementCopy> make_cuda_displacement_copy(int device) { return std::make_unique<CudaCopy>(device); }

}  // namespace tetwarp::simulate
