// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Frames per second: one resampler, field after field.
#include <algorithm>
#include <array>

#include "backend/factories.h"
#include "bench/gpu/gpu_parts.h"
#include "bench/gpu/gpu_scene.h"

namespace tetwarp::bench {

namespace {

using cuda_detail::PinnedBuffer;

/// Elastic fields of these amplitudes, in turn; voxels.
constexpr std::array<float, 3> kAmplitudes{3, 4.5f, 6};

class Loop {
 public:
  Loop(const Volume<std::int16_t>& volume, std::int64_t cell_size, const Options& options)
      : volume_(volume),
        options_(options),
        background_(*std::min_element(volume.voxels.begin(), volume.voxels.end())),
        resampler_(make_forward_resampler(BackendKind::cuda, volume.geometry, options.device)) {
    source_.upload(volume.voxels.data(), volume.voxels.size(), compute_.get());
    for (DeviceBuffer<std::int16_t>& output : outputs_) output.reserve(volume.voxels.size());
    for (std::size_t n = 0; n < kAmplitudes.size(); ++n) {
      fields_[n].generate(make_elastic(kAmplitudes[n]), volume.geometry, cell_size, compute_);
      TETWARP_CUDA_TRY(cudaMemcpy(host_fields_[n].reserve(fields_[n].vertices()), fields_[n].displacement(),
                                  fields_[n].size_bytes(), cudaMemcpyDeviceToHost));
    }
    for (const int frame : {0, 1}) host_output(frame);  // allocates them
  }

  /// Frames per second with all data on the device.
  double run_kernels() {
    run_on_device(options_.warmup);
    const Stopwatch watch;
    run_on_device(options_.frames);
    return 1000 * options_.frames / watch.ms();
  }

  /// Frames per second with copies of the next field and the last output beside the kernels, or copies alone. The
  /// fields on the device become the buffers for the copies.
  double run_with_copies(bool kernels) {
    run_overlapped(options_.warmup, kernels);
    const Stopwatch watch;
    run_overlapped(options_.frames, kernels);
    return 1000 * options_.frames / watch.ms();
  }

  /// Frames per second as a program without CUDA calls it. The time in which it would fill its field is left out.
  double run_host_views() {
    output_ = {volume_.geometry, std::vector<std::int16_t>(volume_.voxels.size())};
    VertexField field{fields_[0].lattice(), std::vector<glm::vec3>(fields_[0].vertices())};
    const Target target{
        .source = view(volume_), .output = view(output_), .background = static_cast<double>(background_)};
    double ms = 0;
    for (int n = -options_.warmup; n < options_.frames; ++n) {
      const glm::vec3* const next = host_field(std::max(n, 0));
      std::copy(next, next + field.displacement.size(), field.displacement.begin());
      const Stopwatch watch;
      resampler_->set_field(view(field));
      resampler_->resample(whole(volume_.geometry), {&target, 1});
      if (n >= 0) ms += watch.ms();
    }
    return 1000 * options_.frames / ms;
  }

  /// The last frames of `run_with_copies` and `run_host_views`, which took the same field.
  void require_same_output() {
    const std::int16_t* const overlapped = host_output(options_.frames - 1);
    if (std::equal(output_.voxels.begin(), output_.voxels.end(), overlapped)) return;
    throw Error("frames with copies beside them gave other voxels than frames from host memory; this is a bug");
  }

 private:
  const glm::vec3* host_field(int frame) {
    const auto n = static_cast<std::size_t>(frame) % kAmplitudes.size();
    return host_fields_[n].reserve(fields_[n].vertices());
  }
  std::int16_t* host_output(int frame) {
    return host_outputs_[static_cast<std::size_t>(frame) % 2].reserve(volume_.voxels.size());
  }

  void run_frame(FieldOnDevice& field, DeviceBuffer<std::int16_t>& output) {
    const Target target{.source = device_view(volume_.geometry, source_.data()),
                        .output = device_view(volume_.geometry, output.data()),
                        .background = static_cast<double>(background_)};
    resampler_->set_field(field.view(), kWithoutRange, on_stream(compute_));
    resampler_->resample(whole(volume_.geometry), {&target, 1}, {}, on_stream(compute_));
  }

  void run_on_device(int frames) {
    for (int n = 0; n < frames; ++n) run_frame(fields_[static_cast<std::size_t>(n) % kAmplitudes.size()], outputs_[0]);
  }

  /// Queues the copy of a frame's field into one of two buffers.
  void upload(int frame) {
    const auto slot = static_cast<std::size_t>(frame % 2);
    TETWARP_CUDA_TRY(cudaMemcpyAsync(fields_[slot].displacement(), host_field(frame), fields_[slot].size_bytes(),
                                     cudaMemcpyHostToDevice, in_.get()));
    uploaded_[slot].record(in_);
  }

  void download(int frame) {
    const auto slot = static_cast<std::size_t>(frame % 2);
    TETWARP_CUDA_TRY(cudaMemcpyAsync(host_output(frame), outputs_[slot].data(),
                                     volume_.voxels.size() * sizeof(std::int16_t), cudaMemcpyDeviceToHost, out_.get()));
    downloaded_[slot].record(out_);
  }

  /// A call of the resampler returns when its frame is done, so a frame's own buffers are free again two frames later
  /// but for the copy out, which the next user of the buffer waits for.
  void run_overlapped(int frames, bool kernels) {
    if (frames > 0) upload(0);
    for (int n = 0; n < frames; ++n) {
      const auto slot = static_cast<std::size_t>(n % 2);
      if (n + 1 < frames) upload(n + 1);
      uploaded_[slot].hold_up(compute_);
      downloaded_[slot].hold_up(compute_);
      if (kernels) run_frame(fields_[slot], outputs_[slot]);
      download(n);
    }
    TETWARP_CUDA_TRY(cudaDeviceSynchronize());
  }

  const Volume<std::int16_t>& volume_;
  const Options& options_;
  const std::int16_t background_;
  Stream compute_{cudaStreamNonBlocking}, in_{cudaStreamNonBlocking}, out_{cudaStreamNonBlocking};
  Event uploaded_[2], downloaded_[2];
  DeviceBuffer<std::int16_t> source_;
  std::array<DeviceBuffer<std::int16_t>, 2> outputs_;
  std::array<FieldOnDevice, kAmplitudes.size()> fields_;
  std::array<PinnedBuffer<glm::vec3>, kAmplitudes.size()> host_fields_;
  std::array<PinnedBuffer<std::int16_t>, 2> host_outputs_;
  std::unique_ptr<ForwardResampler> resampler_;
  Volume<std::int16_t> output_;
};

}  // namespace

FrameLoop measure_frame_loop(const Volume<std::int16_t>& volume, std::int64_t cell_size, const Options& options) {
  Loop loop(volume, cell_size, options);
  FrameLoop rates;
  rates.kernels = loop.run_kernels();
  rates.copies_alone = loop.run_with_copies(false);
  rates.with_copies = loop.run_with_copies(true);
  rates.host_views = loop.run_host_views();
  loop.require_same_output();
  return rates;
}

}  // namespace tetwarp::bench
