// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Tetwarp, the paper's methods and a backward warp, side by side. Compiled as anyone would compile it
// (bench/CMakeLists.txt).
#include <algorithm>

#include "backend/factories.h"
#include "bench/gpu/gpu_backward.h"
#include "bench/gpu/gpu_parts.h"
#include "bench/gpu/gpu_scene.h"
#include "bench/paper/baseline_kernels.cuh"
#include "deform/fields/lattice_mesh.h"

namespace tetwarp::bench {

namespace {

/// One thread a voxel.
__global__ void __launch_bounds__(kThreads)
    backward_kernel(PlainVolume volume, const glm::vec3* places, std::int16_t* output, std::int16_t background) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n < std::int64_t{volume.nx} * volume.ny * volume.nz) output[n] = sample_backward(volume, places[n], background);
}

/// Milliseconds of each frame.
struct Times {
  std::vector<double> set_field, resample, new_field, two, paper, gascon, backward;
};

std::optional<Summary> summary_or_none(const std::vector<double>& ms) {
  return ms.empty() ? std::nullopt : std::optional(summarize(ms));
}

}  // namespace

class GpuMethods::State {
 public:
  State(const Volume<std::int16_t>& volume, const GpuOptions& options)
      : volume_(volume),
        options_(options),
        background_(*std::min_element(volume.voxels.begin(), volume.voxels.end())),
        texture_(glm::ivec3(volume.geometry.size)),
        resampler_(make_forward_resampler(BackendKind::cuda, volume.geometry, options.device)) {
    texture_.upload(volume.voxels.data(), stream_.get());
    source_.upload(volume.voxels.data(), volume.voxels.size(), stream_.get());
    output_.reserve(volume.voxels.size());
    second_.upload(volume.voxels.data(), volume.voxels.size(), stream_.get());
    second_output_.reserve(volume.voxels.size());
  }

  GpuRun measure(const std::string& name, std::int64_t cell_size, Others others) {
    const TestField field = make_test_field(name, volume_.geometry.size);
    field_.generate(field, volume_.geometry, cell_size, stream_);
    const std::optional<TestField> inverse = inverse_of(field);
    others.backward &= inverse.has_value();
    if (others.backward) generate_places(*inverse, volume_.geometry, places_, stream_);
    Times times, untimed;
    for (int n = -options_.warmup; n < options_.frames; ++n) run_frame(others, n < 0 ? untimed : times);
    return {.size = volume_.geometry.size,
            .field = name,
            .cell_size = cell_size,
            .at_rest = field_.at_rest(),
            .set_field_ms = summarize(times.set_field),
            .resample_ms = summarize(times.resample),
            .new_field_ms = summarize(times.new_field),
            .two_ms = summarize(times.two),
            .paper_ms = summary_or_none(times.paper),
            .gascon_ms = summary_or_none(times.gascon),
            .backward_ms = summary_or_none(times.backward),
            .report = report_};
  }

  MeshRun measure_mesh(const std::string& name, std::int64_t cell_size) {
    field_.generate(make_test_field(name, volume_.geometry.size), volume_.geometry, cell_size, stream_);
    VertexField lattice{field_.lattice(), std::vector<glm::vec3>(field_.vertices())};
    TETWARP_CUDA_TRY(
        cudaMemcpy(lattice.displacement.data(), field_.displacement(), field_.size_bytes(), cudaMemcpyDeviceToHost));
    VertexField mesh;
    mesh.mesh = mesh_of(lattice);
    MeshRun run{.field = name, .cell_size = cell_size, .tetrahedra = mesh.mesh.tetrahedra.size()};
    Times times, untimed;
    for (int n = -options_.warmup; n < options_.frames; ++n) {
      Times& to = n < 0 ? untimed : times;
      run_tetwarp(tetwarp::view(mesh, Outside::background), to);
      to.gascon.push_back(run_baseline(Method::gascon));
    }
    run.set_field_ms = summarize(times.set_field);
    run.resample_ms = summarize(times.resample);
    run.gascon_ms = summarize(times.gascon);
    return run;
  }

 private:
  /// Every method once; times from events on the stream.
  void run_frame(const Others& others, Times& times) {
    run_tetwarp(field_.view(), times);
    times.two.push_back(run_two());
    if (others.paper) times.paper.push_back(run_baseline(Method::paper));
    if (others.gascon) times.gascon.push_back(run_baseline(Method::gascon));
    if (others.backward) times.backward.push_back(run_backward());
  }

  void run_tetwarp(const FieldView& field, Times& times) {
    const Target target = target_of(source_, output_);
    start_.record(stream_);
    resampler_->set_field(field, kWithoutRange, on_stream(stream_));
    middle_.record(stream_);
    report_ = resampler_->resample(whole(volume_.geometry), {&target, 1}, {}, on_stream(stream_));
    end_.record(stream_);
    times.new_field.push_back(end_.ms_since(start_));
    times.set_field.push_back(middle_.ms_since(start_));
    times.resample.push_back(end_.ms_since(middle_));
  }

  Target target_of(const DeviceBuffer<std::int16_t>& source, const DeviceBuffer<std::int16_t>& output) const {
    return {.source = device_view(volume_.geometry, source.data()),
            .output = device_view(volume_.geometry, output.data()),
            .background = static_cast<double>(background_)};
  }

  /// Two volumes at once through the field that was set.
  double run_two() {
    const Target targets[] = {target_of(source_, output_), target_of(second_, second_output_)};
    start_.record(stream_);
    resampler_->resample(whole(volume_.geometry), targets, {}, on_stream(stream_));
    end_.record(stream_);
    return end_.ms_since(start_);
  }

  /// The output is cleared before time is taken.
  double run_baseline(Method method) {
    const auto voxels = static_cast<std::int64_t>(volume_.voxels.size());
    fill_kernel<<<blocks_for(voxels), kThreads, 0, stream_.get()>>>(output_.data(), voxels, background_);
    TETWARP_CUDA_TRY(cudaGetLastError());
    start_.record(stream_);
    launch(method, field_.grid(), field_.memory_field(), HardwareTexture{texture_.object()},
           SetValue{output_.data(), nullptr, field_.grid()}, stream_.get());
    end_.record(stream_);
    return end_.ms_since(start_);
  }

  double run_backward() {
    const glm::ivec3 size(volume_.geometry.size);
    start_.record(stream_);
    backward_kernel<<<blocks_for(static_cast<std::int64_t>(volume_.voxels.size())), kThreads, 0, stream_.get()>>>(
        PlainVolume{source_.data(), size.x, size.y, size.z}, places_.data(), output_.data(), background_);
    TETWARP_CUDA_TRY(cudaGetLastError());
    end_.record(stream_);
    return end_.ms_since(start_);
  }

  const Volume<std::int16_t>& volume_;
  const GpuOptions& options_;
  const std::int16_t background_;
  Stream stream_;
  Event start_, middle_, end_;
  Texture texture_;
  DeviceBuffer<std::int16_t> source_, output_, second_, second_output_;
  FieldOnDevice field_;
  DeviceBuffer<glm::vec3> places_;
  std::unique_ptr<ForwardResampler> resampler_;
  Report report_;
};

GpuMethods::GpuMethods(const Volume<std::int16_t>& volume, const GpuOptions& options)
    : state_(std::make_unique<State>(volume, options)) {}

GpuMethods::~GpuMethods() = default;

GpuRun GpuMethods::measure(const std::string& field, std::int64_t cell_size, const Others& others) {
  return state_->measure(field, cell_size, others);
}

MeshRun GpuMethods::measure_mesh(const std::string& field, std::int64_t cell_size) {
  return state_->measure_mesh(field, cell_size);
}

CopyTimes measure_copies(const Geometry& volume, const GpuOptions& options) {
  Stream stream;
  Event start, end;
  DeviceBuffer<std::byte> from, to;
  const auto time_copies = [&](std::size_t bytes) {
    std::vector<double> ms;
    from.fill(1, bytes, stream.get());
    to.reserve(bytes);
    for (int n = -options.warmup; n < options.frames; ++n) {
      start.record(stream);
      TETWARP_CUDA_TRY(cudaMemcpyAsync(to.data(), from.data(), bytes, cudaMemcpyDeviceToDevice, stream.get()));
      end.record(stream);
      const double copied_ms = end.ms_since(start);
      if (n >= 0) ms.push_back(copied_ms);
    }
    return summarize(ms);
  };
  const auto voxels = static_cast<std::size_t>(voxel_count(volume));
  const auto vertices = static_cast<std::size_t>(voxel_count(lattice_over(volume, 1)));
  return {time_copies(voxels * sizeof(std::int16_t)), time_copies(vertices * sizeof(glm::vec3))};
}

}  // namespace tetwarp::bench
