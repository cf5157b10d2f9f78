// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The baselines on a CUDA device, and Tetwarp beside them. Compiled as anyone would compile it: multiplications and
// additions are fused (bench/CMakeLists.txt), unlike in the project's own kernels.
#include "backend/devices.h"
#include "backend/factories.h"
#include "bench/harness/cuda_objects.h"
#include "bench/paper/backend.h"
#include "bench/paper/baseline_kernels.cuh"
#include "cuda/runtime/device_buffer.h"

namespace tetwarp::bench {

namespace {

using cuda_detail::DeviceBuffer;

class CudaBackend final : public Backend {
 public:
  explicit CudaBackend(int device) : Backend(0), device_(select(device)) {}

  Samples time(Method method, FieldSource source, const FrameCount& frames) override {
    upload_source(method);
    const auto run = [&](Samples& times) { run_frame(method, source, times); };
    Samples times = take_turns({{name_of(method), run}}, frames.warmup, frames.timed).front();
    download_output();
    for (int n = 0; n < frames.end_to_end; ++n) run_end_to_end(method, source, times);
    return times;
  }

  const std::vector<std::int16_t>& output() override { return output_; }

 private:
  /// Before any object of CUDA is made. @throws DeviceError
  static int select(int device) {
    const int count = device_count();
    if (device >= count) {
      throw DeviceError("no CUDA device " + std::to_string(device) + ", " + std::to_string(count) +
                        " found; see tetwarp --version, or use --backend cpu");
    }
    TETWARP_CUDA_TRY(cudaSetDevice(device));
    return device;
  }

  Grid grid() const { return make_grid(volume_->geometry, field_.lattice, cell_size_); }
  std::size_t voxels() const { return volume_->voxels.size(); }

  std::unique_ptr<ForwardResampler> make_resampler(const Geometry& geometry) const override {
    return make_forward_resampler(BackendKind::cuda, geometry, device_);
  }

  void volume_changed() override {
    texture_ = std::make_unique<Texture>(glm::ivec3(volume_->geometry.size));
    output_.resize(voxels());
    device_output_.reserve(voxels());
  }

  void fill_field() override {
    run_formula();
    device_field_.download(field_.displacement.data(), field_.displacement.size(), stream_.get());
  }

  void run_formula() {
    const std::int64_t vertices = voxel_count(field_.lattice);
    formula_kernel<<<blocks_for(vertices), kThreads, 0, stream_.get()>>>(
        grid(), FormulaField{formula_}, device_field_.reserve(static_cast<std::size_t>(vertices)));
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  /// To where the method reads it: the texture, or plain memory for Tetwarp.
  void upload_source(Method method) {
    if (method == Method::tetwarp) {
      device_source_.upload(volume_->voxels.data(), voxels(), stream_.get());
    } else {
      texture_->upload(volume_->voxels.data(), stream_.get());
    }
  }

  void upload_field() { device_field_.upload(field_.displacement.data(), field_.displacement.size(), stream_.get()); }

  void download_output() { device_output_.download(output_.data(), voxels(), stream_.get()); }

  void run_baseline(Method method, FieldSource source, std::uint32_t* writes = nullptr) {
    if (source == FieldSource::kernel) {
      run_baseline_on(FormulaField{formula_}, method, writes);
    } else {
      run_baseline_on(MemoryField{device_field_.data(), grid().vertices_x, grid().vertices_y}, method, writes);
    }
  }
  template <class Field>
  void run_baseline_on(const Field& field, Method method, std::uint32_t* writes) {
    const HardwareTexture texture{texture_->object()};
    const SetValue write{device_output_.data(), writes, grid()};
    launch(method, grid(), field, texture, write, stream_.get());
  }

  void set_tetwarp_field(FieldSource source) {
    if (source == FieldSource::kernel) run_formula();
    FieldView on_device = view(field_);
    on_device.displacement = device_field_.data();
    on_device.memory = Memory::device;
    resampler_->set_field(on_device, {}, Control{.stream = stream_.get()});
  }

  void run_tetwarp() {
    const Geometry& geometry = volume_->geometry;
    const Target target{.source = {&geometry, whole(geometry), VoxelType::i16, 1,
                                   reinterpret_cast<std::byte*>(device_source_.data()), Memory::device},
                        .output = {&geometry, whole(geometry), VoxelType::i16, 1,
                                   reinterpret_cast<std::byte*>(device_output_.data()), Memory::device},
                        .background = static_cast<double>(background_)};
    resampler_->resample(whole(geometry), {&target, 1}, {}, Control{.stream = stream_.get()});
  }

  void clear() {
    fill_kernel<<<blocks_for(static_cast<std::int64_t>(voxels())), kThreads, 0, stream_.get()>>>(
        device_output_.data(), static_cast<std::int64_t>(voxels()), background_);
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  /// One frame, all data on the device; its times from events on the stream.
  void run_frame(Method method, FieldSource source, Samples& times) {
    if (method == Method::tetwarp) {
      start_.record(stream_);
      set_tetwarp_field(source);
      middle_.record(stream_);
      run_tetwarp();
      end_.record(stream_);
      times["total_ms"].push_back(end_.ms_since(start_));
      times["field_ms"].push_back(middle_.ms_since(start_));
      times["kernel_ms"].push_back(end_.ms_since(middle_));
    } else {
      clear();
      start_.record(stream_);
      run_baseline(method, source);
      end_.record(stream_);
      times["kernel_ms"].push_back(end_.ms_since(start_));
    }
  }

  /// One frame from the host's memory and back, by the wall clock.
  void run_end_to_end(Method method, FieldSource source, Samples& times) {
    TETWARP_CUDA_TRY(cudaDeviceSynchronize());
    const Stopwatch watch;
    upload_source(method);
    if (source == FieldSource::memory) upload_field();
    times["copy_in_ms"].push_back(watch.ms());
    if (method == Method::tetwarp) {
      set_tetwarp_field(source);
      run_tetwarp();
    } else {
      clear();
      run_baseline(method, source);
    }
    TETWARP_CUDA_TRY(cudaStreamSynchronize(stream_.get()));
    const Stopwatch copy;
    download_output();
    times["copy_out_ms"].push_back(copy.ms());
    times["end_to_end_ms"].push_back(watch.ms());
  }

  std::vector<std::uint32_t> count_baseline_writes(Method method, FieldSource source) override {
    std::vector<std::uint32_t> writes(voxels());
    upload_source(method);
    device_writes_.fill(0, voxels(), stream_.get());
    run_baseline(method, source, device_writes_.data());
    device_writes_.download(writes.data(), voxels(), stream_.get());
    return writes;
  }

  const int device_;
  Stream stream_;
  Event start_, middle_, end_;
  std::unique_ptr<Texture> texture_;
  DeviceBuffer<std::int16_t> device_source_, device_output_;
  DeviceBuffer<glm::vec3> device_field_;
  DeviceBuffer<std::uint32_t> device_writes_;
  std::vector<std::int16_t> output_;
};

}  // namespace

std::unique_ptr<Backend> make_cuda_backend(int device) { return std::make_unique<CudaBackend>(device); }

}  // namespace tetwarp::bench
