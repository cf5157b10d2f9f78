// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cooperative_groups.h>

#include <algorithm>

#include "cuda/factories.h"
#include "cuda/runtime/device_buffer.h"
#include "deform/simulate/chain_plan.h"
#include "deform/simulate/chainmail.h"

namespace tetwarp::simulate {

namespace {

using cuda_detail::DeviceBuffer;
using cuda_detail::DeviceScope;
using cuda_detail::PinnedBuffer;

constexpr int kThreads = 512;
constexpr int kBlocksPerProcessor = 2;
constexpr int kStepsAtOnce = 64;  ///< between questions whether to stop

/// What the blocks of a launch tell each other, and a launch the next one.
struct Notes {
  Pacer pacer;
  std::int32_t steps;
  bool reached;
  std::uint64_t motion;              ///< square of the largest of the last step
  unsigned changed[3];               ///< whether some block changed something: of this round, the last and the next
  unsigned long long new_motion[3];  ///< likewise
};

struct Job {
  ChainView chain;
  const std::int32_t* begins;  ///< of blocks of nodes, and the end of the last
  int blocks;
  Units *now, *before, *shown, *upper, *lower;
  Span* spans;
  PlacedNode* placed;
  int placed_count;
  double part, motion_mm;
  Notes* notes;
};

/// One launch: all its blocks run at the same time, and each always works on the same nodes. What a thread writes to
/// its nodes, others may read at once or later: `tighten` ends at the same numbers either way.
class Crew {
 public:
  __device__ explicit Crew(const Job& job) : job_(job) {}

  __device__ void wait() { cooperative_groups::this_grid().sync(); }

  /// Calls `work` for the nodes of this thread.
  template <class Work>
  __device__ void for_nodes(Work&& work) const {
    for (int block = blockIdx.x; block < job_.blocks; block += gridDim.x) for_nodes_of(block, work);
  }

  /// To where nothing changes; begun after `wait`. Each block goes on by itself for as long as it can.
  ///
  /// In the last round nobody changes anything, so that all have read what there is.
  __device__ void tighten_all() {
    for (bool more = true; more; ++round_) {
      bool any = false;
      for (int block = blockIdx.x; block < job_.blocks; block += gridDim.x) {
        for (bool changed = true; changed;) {
          changed = false;
          for_nodes_of(block, [&](std::int32_t n) { changed |= tighten(job_.chain, job_.upper, job_.lower, n); });
          changed = __syncthreads_or(changed);
          any |= changed;
        }
      }
      if (threadIdx.x == 0) {
        if (any) atomicExch(&job_.notes->changed[round_ % 3], 1u);
        if (blockIdx.x == 0) atomicExch(&job_.notes->changed[(round_ + 1) % 3], 0u);
      }
      wait();
      more = __ldcg(&job_.notes->changed[round_ % 3]) != 0;
    }
  }

  /// Puts each node where `place` says. @return square of the largest motion of all
  template <class Place>
  __device__ std::uint64_t finish(Place&& place) {
    unsigned long long motion = 0;
    for_nodes([&](std::int32_t n) {
      const Units from = job_.now[n], to = place(n);
      job_.before[n] = from;
      job_.now[n] = to;
      motion = max(motion, static_cast<unsigned long long>(square_of_motion(from, to)));
    });
    for (int step = 16; step > 0; step /= 2) motion = max(motion, __shfl_xor_sync(~0u, motion, step));
    if (threadIdx.x % 32 == 0 && motion != 0) atomicMax(&job_.notes->new_motion[finish_ % 3], motion);
    if (threadIdx.x == 0 && blockIdx.x == 0) atomicExch(&job_.notes->new_motion[(finish_ + 1) % 3], 0ull);
    wait();
    return __ldcg(&job_.notes->new_motion[finish_++ % 3]);
  }

 private:
  template <class Work>
  __device__ void for_nodes_of(int block, Work&& work) const {
    const std::int32_t end = job_.begins[block + 1];
    for (std::int32_t n = job_.begins[block] + static_cast<std::int32_t>(threadIdx.x); n < end; n += kThreads) work(n);
  }

  const Job& job_;
  unsigned round_ = 0, finish_ = 0;
};

__device__ bool is_first_thread() { return blockIdx.x == 0 && threadIdx.x == 0; }

/// The chain stage. Notes are 0.
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    follow_kernel(const __grid_constant__ Job job, Pacer pacer) {
  Crew crew(job);
  crew.for_nodes([&](std::int32_t n) {
    job.upper[n] = {{kFarthest, kFarthest, kFarthest}};
    job.lower[n] = {{-kFarthest, -kFarthest, -kFarthest}};
  });
  crew.wait();
  for (int n = static_cast<int>(blockIdx.x * kThreads + threadIdx.x); n < job.placed_count;
       n += static_cast<int>(gridDim.x) * kThreads) {
    job.upper[job.placed[n].node] = job.lower[job.placed[n].node] = job.placed[n].at(job.part);
  }
  crew.wait();
  crew.tighten_all();
  const std::uint64_t motion = crew.finish([&](std::int32_t n) {
    job.spans[n] = span_between(job.upper[n], job.lower[n]);
    return clamped(job.now[n], job.spans[n]);
  });
  if (!is_first_thread()) return;
  job.notes->pacer = pacer;
  job.notes->motion = motion;
}

/// Steps of relaxation, until `steps` in all are made or the motion is small.
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    relax_kernel(const __grid_constant__ Job job, std::int32_t steps) {
  Crew crew(job);
  Pacer pacer = job.notes->pacer;
  std::int32_t made = job.notes->steps;
  bool reached = false;
  std::uint64_t motion = 0;
  while (made < steps && !reached) {
    crew.for_nodes([&](std::int32_t n) {
      job.upper[n] = job.lower[n] = relaxed(job.chain, job.now, job.before, job.spans[n], pacer.pace, n);
    });
    crew.wait();
    crew.tighten_all();
    motion = crew.finish([&](std::int32_t n) { return halfway(job.upper[n], job.lower[n]); });
    ++made;
    reached = sqrt(static_cast<double>(motion)) / kUnitsPerMm <= job.motion_mm;
    pacer.follow(motion);
  }
  if (!is_first_thread()) return;
  job.notes->pacer = pacer;
  job.notes->steps = made;
  job.notes->reached = reached;
  job.notes->motion = motion;
}

/// Brings what is in `upper` and `lower` within the limits.
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) project_kernel(const __grid_constant__ Job job) {
  Crew crew(job);
  crew.tighten_all();
  crew.for_nodes([&](std::int32_t n) { job.now[n] = halfway(job.upper[n], job.lower[n]); });
}

__global__ void start_kernel(Job job) {
  const int n = static_cast<int>(blockIdx.x * kThreads + threadIdx.x);
  if (n < job.placed_count) job.placed[n].start = job.shown[job.placed[n].node];
}

__global__ void show_kernel(Job job, glm::dmat3 direction, const std::int32_t* node_of, glm::vec3* displacement) {
  const int n = static_cast<int>(blockIdx.x * kThreads + threadIdx.x);
  if (n >= job.chain.nodes) return;
  job.shown[n] = job.now[n];
  displacement[node_of[n]] = to_lps(direction, job.now[n]);
}

__global__ void show_placed_kernel(Job job, glm::dmat3 direction, const std::int32_t* node_of,
                                   glm::vec3* displacement) {
  const int n = static_cast<int>(blockIdx.x * kThreads + threadIdx.x);
  if (n >= job.placed_count) return;
  const PlacedNode& one = job.placed[n];
  job.shown[one.node] = one.at(job.part);
  displacement[node_of[one.node]] = to_lps(direction, job.shown[one.node]);
}

unsigned blocks_for(std::int32_t count) { return static_cast<unsigned>((count + kThreads - 1) / kThreads); }

template <class T>
T* uploaded(DeviceBuffer<T>& buffer, const std::vector<T>& host) {
  buffer.upload(host.data(), host.size(), nullptr);
  return buffer.data();
}

class CudaChainmail final : public Simulation {
 public:
  CudaChainmail(const Model& model, int device) : plan_(model), device_(device) {
    const DeviceScope scope(device_);
    std::vector<std::int32_t> begins;
    for (const ChainBlock& block : plan_.blocks) begins.push_back(block.begin);
    begins.push_back(plan_.nodes());
    const auto count = static_cast<std::size_t>(plan_.nodes());
    const auto zero = [&](auto& buffer) {
      buffer.fill(0, count, nullptr);
      return buffer.data();
    };
    job_.chain = {plan_.nodes(), uploaded(around_, plan_.around), uploaded(links_, plan_.links),
                  uploaded(shares_, plan_.shares), zero(moves_)};
    job_.begins = uploaded(begins_, begins);
    job_.blocks = static_cast<int>(plan_.blocks.size());
    job_.now = zero(now_);
    job_.before = zero(before_);
    job_.shown = zero(shown_);
    job_.upper = zero(upper_);
    job_.lower = zero(lower_);
    job_.spans = zero(spans_);
    job_.notes = notes_.reserve(1);
    uploaded(node_of_, plan_.node_of);
    zero(displacement_);
    host_notes_.reserve(1);
    int processors = 0;
    TETWARP_CUDA_TRY(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device_));
    crew_ = static_cast<unsigned>(std::min(job_.blocks, processors * kBlocksPerProcessor));
    TETWARP_CUDA_TRY(cudaDeviceSynchronize());
  }

  void set_loads(const Loads& loads) override {
    const std::vector<PlacedNode> placed = plan_.read(loads);
    const std::vector<std::uint8_t> moves = plan_.moving(placed);
    const DeviceScope scope(device_);
    uploaded(moves_, moves);
    job_.placed = placed_.reserve(placed.size() + 1);
    job_.placed_count = static_cast<int>(placed.size());
    has_loads_ = true;
    if (placed.empty()) return;
    uploaded(placed_, placed);
    start_kernel<<<blocks_for(job_.placed_count), kThreads>>>(job_);
    TETWARP_CUDA_TRY(cudaGetLastError());
    TETWARP_CUDA_TRY(cudaStreamSynchronize(nullptr));
  }

  Settled advance(double part, const StoppingRule& rule, const Control& control) override {
    require(has_loads_, "advance needs loads: call set_loads first");
    require_valid(part, rule);
    if (control.stop.stop_requested()) throw Cancelled();
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    job_.part = part;
    job_.motion_mm = rule.motion_mm;
    clear_notes();
    Pacer pacer(plan_.momentum, plan_.patience);
    launch(follow_kernel, job_, pacer);
    Notes& notes = host_notes_.reserve(1)[0];
    notes.steps = 0;
    notes.reached = false;
    while (notes.steps < rule.steps && !notes.reached && !control.stop.stop_requested()) {
      clear_rounds();
      std::int32_t until = std::min(rule.steps, notes.steps + kStepsAtOnce);
      launch(relax_kernel, job_, until);
      read_notes();
      if (control.progress) control.progress(static_cast<double>(notes.steps) / rule.steps);
    }
    const bool cancelled = notes.steps < rule.steps && !notes.reached;
    show();
    read_notes();
    if (cancelled) throw Cancelled();
    return {.steps = notes.steps, .motion_mm = motion_mm(notes.motion), .reached = notes.reached};
  }

  std::span<const glm::vec3> displacement() const override {
    return {displacement_.data(), static_cast<std::size_t>(plan_.nodes())};
  }
  Memory memory() const override { return Memory::device; }

  std::vector<glm::vec3> displacement_on_host() const override {
    const DeviceScope scope(device_);
    std::vector<glm::vec3> result(static_cast<std::size_t>(plan_.nodes()));
    displacement_.download(result.data(), result.size(), nullptr);
    return result;
  }

  void set_displacement(std::span<const glm::vec3> displacement) override {
    const std::vector<Units> units = plan_.to_units(displacement);
    const DeviceScope scope(device_);
    stream_ = nullptr;
    uploaded(upper_, units);
    uploaded(lower_, units);
    clear_notes();
    launch(project_kernel, job_);
    Job free = job_;
    free.placed_count = 0;
    show(free);
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream_));
  }

 private:
  /// All blocks at the same time.
  template <class... Arguments>
  void launch(void (*kernel)(Arguments...), Arguments&... arguments) {
    void* pointers[] = {&arguments...};
    TETWARP_CUDA_TRY(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(kernel), dim3(crew_), dim3(kThreads),
                                                 pointers, 0, stream_));
  }

  void clear_notes() { notes_.fill(0, 1, stream_); }
  /// What the blocks tell each other begins anew with each launch.
  void clear_rounds() {
    constexpr std::size_t kFirst = offsetof(Notes, changed);
    TETWARP_CUDA_TRY(
        cudaMemsetAsync(reinterpret_cast<std::byte*>(job_.notes) + kFirst, 0, sizeof(Notes) - kFirst, stream_));
  }
  void read_notes() {
    TETWARP_CUDA_TRY(
        cudaMemcpyAsync(host_notes_.reserve(1), job_.notes, sizeof(Notes), cudaMemcpyDeviceToHost, stream_));
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream_));
  }

  void show() { show(job_); }
  void show(const Job& job) {
    show_kernel<<<blocks_for(plan_.nodes()), kThreads, 0, stream_>>>(job, plan_.direction, node_of_.data(),
                                                                     displacement_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    if (job.placed_count == 0) return;
    show_placed_kernel<<<blocks_for(job.placed_count), kThreads, 0, stream_>>>(job, plan_.direction, node_of_.data(),
                                                                               displacement_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  ChainPlan plan_;
  int device_;
  unsigned crew_ = 1;  ///< blocks of a launch
  cudaStream_t stream_ = nullptr;
  bool has_loads_ = false;
  Job job_{};
  DeviceBuffer<std::int32_t> around_, shares_, begins_, node_of_;
  DeviceBuffer<LinkUnits> links_;
  DeviceBuffer<std::uint8_t> moves_;
  DeviceBuffer<Units> now_, before_, shown_, upper_, lower_;
  DeviceBuffer<Span> spans_;
  DeviceBuffer<PlacedNode> placed_;
  DeviceBuffer<Notes> notes_;
  PinnedBuffer<Notes> host_notes_;
  DeviceBuffer<glm::vec3> displacement_;
};

}  // namespace

std::unique_ptr<Simulation> make_cuda_chainmail(const Model& model, int device) {
  return std::make_unique<CudaChainmail>(model, device);
}

}  // namespace tetwarp::simulate
