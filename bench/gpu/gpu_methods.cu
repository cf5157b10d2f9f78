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

class DeviceMethods final : public GpuMethods {
 public:
  DeviceMethods(const Volume<std::int16_t>& volume, const Options& options)
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

  GpuMeasure measure(const std::string& name, std::int64_t cell_size, Others others) override {
    const TestField field = make_test_field(name, volume_.geometry.size);
    field_.generate(field, volume_.geometry, cell_size, stream_);
    const std::optional<TestField> inverse = inverse_of(field);
    if (others.backward && inverse) generate_places(*inverse, volume_.geometry, places_, stream_);
    const auto every_method = [&](Samples& times) {
      run_tetwarp(field_.view(), times);
      times["two_volumes_ms"].push_back(run_two());
      if (others.paper) times["paper_ms"].push_back(run_baseline(Method::paper));
      if (others.gascon) times["gascon_ms"].push_back(run_baseline(Method::gascon));
      if (others.backward && inverse) times["backward_ms"].push_back(run_backward());
    };
    return {take_turns({{name, every_method}}, options_.warmup, options_.frames).front(), field_.at_rest(), 0, report_};
  }

  GpuMeasure measure_mesh(const std::string& name, std::int64_t cell_size) override {
    field_.generate(make_test_field(name, volume_.geometry.size), volume_.geometry, cell_size, stream_);
    VertexField mesh;
    mesh.mesh = mesh_of(field_.on_host());
    const auto both = [&](Samples& times) {
      run_tetwarp(tetwarp::view(mesh, Outside::background), times);
      times["gascon_ms"].push_back(run_baseline(Method::gascon));
    };
    return {take_turns({{name, both}}, options_.warmup, options_.frames).front(), field_.at_rest(),
            mesh.mesh.tetrahedra.size(), report_};
  }

 private:
  /// Times from events on the stream.
  void run_tetwarp(const FieldView& field, Samples& times) {
    const Target target = target_of(source_, output_);
    start_.record(stream_);
    resampler_->set_field(field, kWithoutRange, on_stream(stream_));
    middle_.record(stream_);
    report_ = resampler_->resample(whole(volume_.geometry), {&target, 1}, {}, on_stream(stream_));
    end_.record(stream_);
    times["new_field_ms"].push_back(end_.ms_since(start_));
    times["set_field_ms"].push_back(middle_.ms_since(start_));
    times["resample_ms"].push_back(end_.ms_since(middle_));
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
  const Options& options_;
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

}  // namespace

std::unique_ptr<GpuMethods> make_gpu_methods(const Volume<std::int16_t>& volume, const Options& options) {
  TETWARP_CUDA_TRY(cudaSetDevice(options.device));
  return std::make_unique<DeviceMethods>(volume, options);
}

Samples measure_copies(const Geometry& volume, const Options& options) {
  TETWARP_CUDA_TRY(cudaSetDevice(options.device));
  Stream stream;
  Event start, end;
  DeviceBuffer<std::byte> from, to;
  Samples times;
  const auto copy = [&](const char* name, std::size_t bytes) {
    from.fill(1, bytes, stream.get());
    to.reserve(bytes);
    const auto once = [&](Samples& samples) {
      start.record(stream);
      TETWARP_CUDA_TRY(cudaMemcpyAsync(to.data(), from.data(), bytes, cudaMemcpyDeviceToDevice, stream.get()));
      end.record(stream);
      samples[name].push_back(end.ms_since(start));
    };
    times.merge(take_turns({{name, once}}, options.warmup, options.frames).front());
  };
  copy("volume_ms", static_cast<std::size_t>(voxel_count(volume)) * sizeof(std::int16_t));
  copy("field_ms", static_cast<std::size_t>(voxel_count(lattice_over(volume, 1))) * sizeof(glm::vec3));
  return times;
}

}  // namespace tetwarp::bench
