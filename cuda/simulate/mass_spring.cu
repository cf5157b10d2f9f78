// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>

#include "cuda/factories.h"
#include "cuda/runtime/device_buffer.h"
#include "cuda/runtime/launch.cuh"
#include "cuda/runtime/stream.h"
#include "cuda/runtime/warp.cuh"
#include "deform/simulate/spring_solver.h"

namespace tetwarp::simulate {

namespace {

using cuda_detail::DeviceBuffer;
using cuda_detail::DeviceScope;

/// Threads of a block: one a node whose sum is made with it.
constexpr int kBlock = kSumBlock;

unsigned blocks_for(std::size_t nodes) { return cuda_detail::blocks_for(static_cast<std::int64_t>(nodes), kBlock); }

/// Calls a sweep for every node; a thread a node.
///
/// @param sweep  `sweep(n)` writes what belongs to node n
template <class Sweep>
__global__ void each_kernel(Sweep sweep, std::size_t nodes) {
  if (sweep.is_idle()) return;
  const std::size_t n = std::size_t{blockIdx.x} * kBlock + threadIdx.x;
  if (n < nodes) sweep(n);
}

/// Adds up what a sweep gives for every node, a thread a node, in the order that kSumBlock states. The block that
/// arrives last adds up what all left.
///
/// @param sweep     `sweep(n)` gives what is added for node n  @param then  `then(sum)` is called by one thread
/// @param of_block  room for the sum of each block: written, and read by the last block
/// @param arrived   how many blocks have arrived: 0 before and after
template <class T, class Sweep, class Then>
__global__ void sum_kernel(Sweep sweep, Then then, std::size_t nodes, T* of_block, unsigned* arrived) {
  if (sweep.is_idle()) return;
  const std::size_t n = std::size_t{blockIdx.x} * kBlock + threadIdx.x;
  const T sum = cuda_detail::sum_of_block<kBlock>(n < nodes ? sweep(n) : T{});
  __shared__ bool is_last;
  if (threadIdx.x == 0) {
    of_block[blockIdx.x] = sum;
    __threadfence();
    is_last = atomicAdd(arrived, 1u) == gridDim.x - 1;
  }
  __syncthreads();
  if (!is_last) return;
  __threadfence();
  T own{};
  for (unsigned block = threadIdx.x; block < gridDim.x; block += kBlock) own.add(of_block[block]);
  const T total = cuda_detail::sum_of_block<kBlock>(own);
  if (threadIdx.x == 0) {
    *arrived = 0;
    then(total);
  }
}

/// Work that was recorded and can be queued at once.
class Graph {
 public:
  Graph() = default;
  ~Graph() {
    if (graph_) cudaGraphExecDestroy(graph_);
  }
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  bool is_recorded() const { return graph_ != nullptr; }
  /// @param work  queues on the stream that it is given, and nowhere else
  template <class Work>
  void record(const Work& work) {
    const cuda_detail::Stream stream;
    cudaGraph_t recorded = nullptr;
    TETWARP_CUDA_TRY(cudaStreamBeginCapture(stream.get(), cudaStreamCaptureModeThreadLocal));
    work(stream.get());
    TETWARP_CUDA_TRY(cudaStreamEndCapture(stream.get(), &recorded));
    const cudaError_t status = cudaGraphInstantiate(&graph_, recorded, 0);
    cudaGraphDestroy(recorded);
    TETWARP_CUDA_TRY(status);
  }
  void queue(cudaStream_t stream) const { TETWARP_CUDA_TRY(cudaGraphLaunch(graph_, stream)); }

 private:
  cudaGraphExec_t graph_ = nullptr;
};

/// See SpringSolver.
class CudaMachine {
 public:
  static constexpr Memory kMemory = Memory::device;
  static constexpr bool kReadsLinks = true;
  template <class T>
  using Buffer = DeviceBuffer<T>;

  CudaMachine(int device, std::size_t nodes) : device_(device) {
    const DeviceScope here(device_);
    of_block_.reserve(blocks_for(nodes));
    arrived_.fill(0, 1, nullptr);
    pinned_.reserve(1);
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
  template <class Work>
  void repeat(int times, const Work& work) {
    if (!repeated_.is_recorded()) {
      repeated_.record([&](cudaStream_t recording) {
        const cudaStream_t before = std::exchange(stream_, recording);
        for (int n = 0; n < times; ++n) work();
        stream_ = before;
      });
    }
    repeated_.queue(stream_);
  }

 private:
  struct alignas(16) Fetched {
    std::byte bytes[256];
  };

  int device_;
  cudaStream_t stream_ = nullptr;
  DeviceBuffer<Ways> of_block_;  ///< room for the largest of sums
  DeviceBuffer<unsigned> arrived_;
  cuda_detail::PinnedBuffer<Fetched> pinned_;
  Graph repeated_;
};

}  // namespace

std::unique_ptr<Simulation> make_cuda_mass_spring(const Model& model, int device) {
  require_springs(model);
  return make_mass_spring(model, std::make_unique<SpringSolver<CudaMachine>>(model, device, model.nodes()));
}

}  // namespace tetwarp::simulate
