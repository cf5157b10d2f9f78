// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "cuda/factories.h"
#include "cuda/runtime/device_buffer.h"
#include "cuda/simulate/chain_crew.cuh"
#include "deform/simulate/chainmail.h"

namespace tetwarp::simulate {

namespace {

using cuda_detail::blocks_for;
using cuda_detail::DeviceBuffer;
using cuda_detail::DeviceScope;
using cuda_detail::PinnedBuffer;

constexpr int kStepsAtOnce = 64;  ///< between questions whether to stop

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
    job_.ranges = zero(ranges_);
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
    advances_ = 0;
    paths_ = {};
    if (placed.empty()) return;
    uploaded(placed_, placed);
    start_kernel<<<blocks_for(job_.placed_count, kThreads), kThreads>>>(job_);
    TETWARP_CUDA_TRY(cudaGetLastError());
    TETWARP_CUDA_TRY(cudaStreamSynchronize(nullptr));
  }

  Convergence advance(double part, const StoppingRule& rule, const Control& control) override {
    require(has_loads_, "advance needs loads: call set_loads first");
    require_valid(part, rule);
    if (control.stop.stop_requested()) throw Cancelled();
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    job_.part = part;
    job_.motion_mm = rule.motion_mm;
    clear_notes();
    Pacer pacer(plan_.momentum, plan_.patience);
    SetPaths paths = follow(part, pacer);
    Notes& notes = host_notes_.reserve(1)[0];
    notes.steps = 0;
    notes.reached = false;
    bool is_shown = false;
    while (paths.count > 0 || (notes.steps < rule.steps && !notes.reached && !control.stop.stop_requested())) {
      clear_rounds();
      std::int32_t until = std::min(rule.steps, notes.steps + kStepsAtOnce);
      launch(relax_kernel, job_, until, pacer, paths);
      paths.count = 0;                 // the chain stage is made
      is_shown = until == rule.steps;  // these are the last steps: what follows need not wait for the host
      if (is_shown) show(job_.placed_count, deadband_square());
      read_notes();
      if (control.progress) control.progress(static_cast<double>(notes.steps) / rule.steps);
    }
    const bool cancelled = notes.steps < rule.steps && !notes.reached;
    if (!is_shown) {
      show(job_.placed_count, deadband_square());
      read_notes();
    }
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
    show(0, 0);
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream_));
  }

  std::vector<std::byte> state() const override {
    const DeviceScope scope(device_);
    const auto count = static_cast<std::size_t>(plan_.nodes());
    std::vector<Units> now(count), shown(count);
    now_.download(now.data(), count, nullptr);
    shown_.download(shown.data(), count, nullptr);
    return state_of_chain(now, shown, displacement_on_host());
  }
  void set_state(std::span<const std::byte> state) override {
    const auto count = static_cast<std::size_t>(plan_.nodes());
    std::vector<Units> now(count), shown(count);
    std::vector<glm::vec3> displacement(count);
    read_chain_state(state, now, shown, displacement);
    const DeviceScope scope(device_);
    uploaded(now_, now);
    uploaded(shown_, shown);
    uploaded(displacement_, displacement);
    job_.placed_count = 0;
    has_loads_ = false;
  }

 private:
  /// Makes the chain stage. Where it is made again for the same loads, the paths of their sets are followed once.
  /// @return paths by which it is still to be made, if any
  SetPaths follow(double part, Pacer& pacer) {
    if (++advances_ == 2) find_paths();
    if (paths_.count == 0) {
      launch(follow_kernel, job_, pacer);
      return {};
    }
    for (std::size_t set = 0; set < ways_.size(); ++set) paths_.at[set] = ways_[set].at(part);
    return paths_;
  }

  void find_paths() {
    std::vector<PlacedNode> placed(static_cast<std::size_t>(job_.placed_count));
    placed_.download(placed.data(), placed.size(), stream_);
    std::vector<PlacedSet> sets = plan_.sets_of(placed);
    placed_.upload(placed.data(), placed.size(), stream_);
    ways_.clear();
    const auto nodes = static_cast<std::size_t>(plan_.nodes());
    paths_.upper = path_upper_.reserve(sets.size() * nodes);
    paths_.lower = path_lower_.reserve(sets.size() * nodes);
    for (PlacedSet& set : sets) {
      Job job = job_;
      job.upper = path_upper_.data() + ways_.size() * nodes;
      job.lower = path_lower_.data() + ways_.size() * nodes;
      clear_rounds();
      launch(path_kernel, job, set);
      ways_.push_back(placed[set.begin]);
    }
    clear_rounds();
    paths_.nodes = plan_.nodes();
    paths_.count = static_cast<int>(sets.size());
  }

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

  /// @param square  see `shown_of`
  void show(int placed_count, float square) {
    const auto count = static_cast<std::size_t>(plan_.nodes());
    TETWARP_CUDA_TRY(cudaMemcpyAsync(job_.shown, job_.now, count * sizeof(Units), cudaMemcpyDeviceToDevice, stream_));
    if (placed_count > 0) {
      show_placed_kernel<<<blocks_for(placed_count, kThreads), kThreads, 0, stream_>>>(job_);
      TETWARP_CUDA_TRY(cudaGetLastError());
    }
    show_kernel<<<blocks_for(plan_.nodes(), kThreads), kThreads, 0, stream_>>>(job_, plan_.direction, node_of_.data(),
                                                                               square, displacement_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  ChainPlan plan_;
  int device_;
  unsigned crew_ = 1;  ///< blocks of a launch
  cudaStream_t stream_ = nullptr;
  bool has_loads_ = false;
  int advances_ = 0;                             ///< with these loads
  SetPaths paths_;                               ///< of the sets of placed nodes, from the second advance on
  std::vector<PlacedNode> ways_;                 ///< one node of each set
  DeviceBuffer<Units> path_upper_, path_lower_;  ///< to which `paths_` refers
  Job job_{};
  DeviceBuffer<std::int32_t> around_, shares_, begins_, node_of_;
  DeviceBuffer<LinkUnits> links_;
  DeviceBuffer<std::uint8_t> moves_;
  DeviceBuffer<Units> now_, before_, shown_, upper_, lower_;
  DeviceBuffer<DisplacementRange> ranges_;
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
