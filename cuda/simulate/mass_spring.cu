// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>

#include "cuda/factories.h"
#include "cuda/runtime/device_buffer.h"
#include "cuda/simulate/spring_crew.cuh"

namespace tetwarp::simulate {

namespace {

using cuda_detail::DeviceBuffer;
using cuda_detail::DeviceScope;

unsigned blocks_for(std::size_t nodes) { return cuda_detail::blocks_for(static_cast<std::int64_t>(nodes), kBlock); }

/// See SpringSolver.
class CudaMachine {
 public:
  static constexpr Memory kMemory = Memory::device;
  static constexpr bool kReadsLinks = true;
  static constexpr std::size_t kNumbersOfVector = 4;  ///< of a Quad
  static constexpr int kIterations = 128;             ///< most systems of a frame take fewer
  template <class T>
  using Buffer = DeviceBuffer<T>;

  CudaMachine(int device, std::size_t nodes) : device_(device) {
    const DeviceScope here(device_);
    of_block_.reserve(blocks_for(nodes));
    products_.reserve(blocks_for(nodes));
    sums_.reserve(blocks_for(nodes));
    arrived_.fill(0, 1, nullptr);
    pinned_.reserve(1);
    int processors = 0;
    TETWARP_CUDA_TRY(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device_));
    // All must run at the same time. As few as have no more rounds of blocks of nodes than the most would have.
    const unsigned blocks = blocks_for(nodes), most = static_cast<unsigned>(processors * kCrewPerProcessor),
                   rounds = (blocks + most - 1) / most;
    crew_ = (blocks + rounds - 1) / rounds;
  }

  std::size_t padding() const { return 0; }
  DeviceScope scope() const { return DeviceScope(device_); }
  void set_stream(void* stream) { stream_ = static_cast<cudaStream_t>(stream); }
  void wait() const { TETWARP_CUDA_TRY(cudaStreamSynchronize(stream_)); }

  template <class T>
  void upload(T* place, const T* host, std::size_t size) const {
    TETWARP_CUDA_TRY(cudaMemcpyAsync(place, host, size * sizeof(T), cudaMemcpyHostToDevice, stream_));
    wait();
  }
  template <class T>
  void download(T* to, const T* from, std::size_t count) {
    TETWARP_CUDA_TRY(cudaMemcpyAsync(to, from, count * sizeof(T), cudaMemcpyDeviceToHost, stream_));
    wait();
  }
  template <class T>
  T fetch(const T* place) {
    static_assert(sizeof(T) <= sizeof(Fetched));
    void* const to = pinned_.reserve(1);
    TETWARP_CUDA_TRY(cudaMemcpyAsync(to, place, sizeof(T), cudaMemcpyDeviceToHost, stream_));
    wait();
    return *static_cast<const T*>(to);
  }

  template <class Sweep>
  void each(std::size_t nodes, const Sweep& sweep) {
    each_kernel<<<blocks_for(nodes), kBlock, 0, stream_>>>(sweep, nodes);
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
  template <class T, class Sweep, class Then>
  void sum(std::size_t nodes, const Sweep& sweep, const Then& then) {
    static_assert(sizeof(T) <= sizeof(Ways));
    T* const of_block = reinterpret_cast<T*>(of_block_.data());
    sum_kernel<T><<<blocks_for(nodes), kBlock, 0, stream_>>>(sweep, then, nodes, of_block, arrived_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
  void solve(const SpringArrays& arrays, const SolveTask& task) {
    SpringArrays a = arrays;
    SolveTask given = task;
    Products* products = products_.data();
    Sums* sums = sums_.data();
    void* arguments[] = {&a, &given, &products, &sums};
    TETWARP_CUDA_TRY(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(solve_kernel), dim3(crew_), dim3(kBlock),
                                                 arguments, 0, stream_));
  }

 private:
  struct alignas(16) Fetched {
    std::byte bytes[512];
  };

  int device_;
  unsigned crew_ = 1;  ///< blocks of `solve_kernel`
  cudaStream_t stream_ = nullptr;
  DeviceBuffer<Ways> of_block_;  ///< room for the largest of sums
  DeviceBuffer<Products> products_;
  DeviceBuffer<Sums> sums_;
  DeviceBuffer<unsigned> arrived_;
  cuda_detail::PinnedBuffer<Fetched> pinned_;
};

}  // namespace

std::unique_ptr<Simulation> make_cuda_mass_spring(const Model& model, int device) {
  require_springs(model);
  return make_mass_spring(model, std::make_unique<SpringSolver<CudaMachine>>(model, device, model.nodes()));
}

}  // namespace tetwarp::simulate
