// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Source and output of a frame loop on a CUDA device.
#include "bench/gpu/gpu_scene.h"
#include "bench/simulate/simulate_bench.h"

namespace tetwarp::bench {

namespace {

class DeviceVolumes final : public FrameVolumes {
 public:
  DeviceVolumes(const Volume<std::int16_t>& volume, double background) : volume_(volume), background_(background) {
    const Stream stream;
    source_.upload(volume.voxels.data(), volume.voxels.size(), stream.get());
    output_.reserve(volume.voxels.size());
    TETWARP_CUDA_TRY(cudaDeviceSynchronize());
  }
  Target target() override {
    return {.source = device_view(volume_.geometry, source_.data()),
            .output = device_view(volume_.geometry, output_.data()),
            .background = background_};
  }

 private:
  const Volume<std::int16_t>& volume_;
  double background_;
  DeviceBuffer<std::int16_t> source_, output_;
};

}  // namespace

std::unique_ptr<FrameVolumes> make_device_volumes(const Volume<std::int16_t>& volume, double background) {
  return std::make_unique<DeviceVolumes>(volume, background);
}

}  // namespace tetwarp::bench
