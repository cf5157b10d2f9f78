// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What a resampler allocates on the device.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "backend/factories.h"
#include "bench/gpu/gpu_parts.h"
#include "bench/gpu/gpu_scene.h"

namespace tetwarp::bench {

namespace {

constexpr int kFrames = 3;

std::uint64_t free_bytes() {
  std::size_t free = 0, total = 0;
  TETWARP_CUDA_TRY(cudaMemGetInfo(&free, &total));
  return free;
}

/// The most device memory in use since it was made, counted from then. Other processes on the device count too.
class MemoryWatch {
 public:
  explicit MemoryWatch(int device)
      : before_(free_bytes()), least_(before_), thread_([this, device](const std::stop_token& stop) {
          cudaSetDevice(device);
          while (!stop.stop_requested()) {
            look();
            std::this_thread::sleep_for(std::chrono::microseconds(200));
          }
        }) {}

  /// Beside the looks that a thread takes all the time.
  void look() {
    std::size_t free = 0, total = 0;
    if (cudaMemGetInfo(&free, &total) != cudaSuccess) return;
    std::uint64_t least = least_;
    while (free < least && !least_.compare_exchange_weak(least, free)) {
    }
  }
  std::uint64_t most() const { return before_ - least_; }

 private:
  const std::uint64_t before_;
  std::atomic<std::uint64_t> least_;
  std::jthread thread_;  // last: it uses the others
};

/// Most that a new resampler holds in a few frames.
std::uint64_t watch_frames(const FieldView& field, const Target& target, int device) {
  const Geometry& volume = *target.output.geometry;
  MemoryWatch watch(device);
  const std::unique_ptr<ForwardResampler> resampler = make_forward_resampler(BackendKind::cuda, volume, device);
  const Control looking{.progress = [&](double) { watch.look(); }};
  for (int n = 0; n < kFrames; ++n) {
    resampler->set_field(field);
    watch.look();
    resampler->resample(whole(volume), {&target, 1}, {}, looking);
  }
  return watch.most();
}

std::uint64_t watch_device_views(const Volume<std::int16_t>& volume, FieldOnDevice& field, double background,
                                 const Stream& stream, int device) {
  DeviceBuffer<std::int16_t> source, output;
  source.upload(volume.voxels.data(), volume.voxels.size(), stream.get());
  output.reserve(volume.voxels.size());
  const Target target{.source = device_view(volume.geometry, source.data()),
                      .output = device_view(volume.geometry, output.data()),
                      .background = background};
  return watch_frames(field.view(), target, device);
}

}  // namespace

MemoryUse measure_memory(const Volume<std::int16_t>& volume, const std::string& name, const Options& options) {
  const Stream stream;
  const double background = *std::min_element(volume.voxels.begin(), volume.voxels.end());
  FieldOnDevice on_device;
  on_device.generate(make_test_field(name, volume.geometry.size), volume.geometry, 1, stream);
  MemoryUse use{.data = 2 * volume.voxels.size() * sizeof(std::int16_t) + on_device.size_bytes()};
  const VertexField field = on_device.on_host();
  Volume<std::int16_t> output{volume.geometry, std::vector<std::int16_t>(volume.voxels.size())};
  const Target target{.source = view(volume), .output = view(output), .background = background};
  watch_frames(view(field), target, options.device);  // the driver loads kernels with their first call
  use.host_views = watch_frames(view(field), target, options.device);
  use.device_views = watch_device_views(volume, on_device, background, stream, options.device);
  return use;
}

}  // namespace tetwarp::bench
