// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/output/cuda_resampler.h"

#include <glm/common.hpp>
#include <vector>

#include "cuda/factories.h"
#include "cuda/runtime/pointer_check.h"
#include "deform/field_check.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace cuda_detail {

namespace {

/// Where each voxel of a box comes from; a thread a voxel.
///
/// @param frame   its samples are in device memory
/// @param mapped  written, one for each voxel of the box in their order: 1 where it comes from anywhere, else 0
/// @param offset  written, one for each voxel of the box: undeformed minus deformed place, voxels
__global__ void pull_kernel(PullFrame frame, SlabBox box, std::uint8_t* mapped, glm::vec3* offset) {
  const std::int64_t n = thread_of_grid();
  if (n < box.count()) mapped[n] = frame.offset_at(box.voxel(n), offset[n]);
}

/// Finds the first sample that cannot be used; a thread a sample.
///
/// @param samples  how many  @param bad  the least number of such a sample, by an atomic minimum
__global__ void check_pull_kernel(PullFrame frame, std::int64_t samples, unsigned long long* bad) {
  const std::int64_t n = thread_of_grid();
  if (n >= samples || frame.is_usable(frame.displacement[n])) return;
  atomicMin(bad, static_cast<unsigned long long>(n));
}

/// How far the samples of one slice of a pull field point, at least and at most; voxels, 0 included. Missing ones do
/// not count.
struct ShiftBounds {
  glm::dvec3 least{0}, most{0};
};

class SampledPullResampler final : public CudaResampler<PullResampler> {
 public:
  using CudaResampler::CudaResampler;

  void set_field(const PullFieldView& field, const Control& control) override {
    ready_ = false;
    frame_ = make_pull_frame(output(), field);
    grid_ = *field.grid;
    given_ = field.displacement;
    given_in_ = field.memory;
    shifts_.clear();
    if (control.stop.stop_requested()) throw Cancelled();
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    require_memory(field.displacement, field.memory, "the field");
    if (field.memory == Memory::host) frame_.displacement = hold(field.displacement);
    const std::int64_t samples = voxel_count(grid_);
    bad_.fill(0xFF, 1, stream_);
    check_pull_kernel<<<blocks_for(samples), kThreads, 0, stream_>>>(frame_, samples, bad_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    unsigned long long bad = 0;
    bad_.download(&bad, 1, stream_);
    if (bad != ~0ULL) refuse_sample(unravel(static_cast<std::int64_t>(bad), frame_.size));
    ready_ = true;
  }

 private:
  /// Uploads a field that is on the host.
  const glm::vec3* hold(const glm::vec3* displacement) {
    const auto samples = static_cast<std::size_t>(voxel_count(grid_));
    const std::uint64_t bytes = samples * sizeof(glm::vec3);
    if (!may_hold(bytes)) refuse_field(bytes, allowed_bytes());
    make_room_for_field(bytes);
    displacement_.reserve(samples);
    uploads_->copy(reinterpret_cast<std::byte*>(displacement_.data()), reinterpret_cast<const std::byte*>(displacement),
                   bytes, stream_);
    return displacement_.data();
  }

  /// The frame with its samples on the host. @param room  for those that are not there
  PullFrame frame_on_host(std::vector<glm::vec3>& room) const {
    PullFrame frame = frame_;
    frame.displacement = given_;
    if (given_in_ == Memory::host) return frame;
    room.resize(static_cast<std::size_t>(voxel_count(grid_)));
    const DeviceScope scope(device_);
    TETWARP_CUDA_TRY(cudaMemcpy(room.data(), given_, room.size() * sizeof(glm::vec3), cudaMemcpyDeviceToHost));
    frame.displacement = room.data();
    return frame;
  }

  Region source_extent(const Geometry& source, const Region& region) const override {
    std::vector<glm::vec3> room;
    return pull_source_region(frame_on_host(room), grid_, output(), source, region);
  }

  void prepare_slabs() override {
    if (!shifts_.empty()) return;
    std::vector<glm::vec3> room;
    const PullFrame frame = frame_on_host(room);
    shifts_.resize(static_cast<std::size_t>(frame.size.z));
    for (std::int64_t z = 0; z < frame.size.z; ++z) {
      ShiftBounds& bounds = shifts_[static_cast<std::size_t>(z)];
      for (std::int64_t y = 0; y < frame.size.y; ++y) {
        for (std::int64_t x = 0; x < frame.size.x; ++x) {
          if (PullFrame::is_missing(frame.vector({x, y, z}))) continue;
          const glm::dvec3 shift = frame.sample({x, y, z});
          bounds.least = glm::min(bounds.least, shift);
          bounds.most = glm::max(bounds.most, shift);
        }
      }
    }
  }

  Region slab_source(const Geometry& source, const Region& slab) const override {
    const glm::dvec3 first(slab.begin), last(slab.end - std::int64_t{1});
    const Region samples = source_box(grid_, output(), first, last);
    ShiftBounds all;
    for (std::int64_t z = samples.begin.z; z < samples.end.z; ++z) {
      const ShiftBounds& bounds = shifts_[static_cast<std::size_t>(z)];
      all.least = glm::min(all.least, bounds.least);
      all.most = glm::max(all.most, bounds.most);
    }
    return source_box(source, output(), first + all.least, last + all.most);
  }

  std::uint64_t field_bytes(const Slices&) const override { return given_in_ == Memory::host ? held_field_bytes() : 0; }
  std::uint64_t held_field_bytes() const override { return displacement_.capacity() * sizeof(glm::vec3); }
  const char* held_of_field() const override { return "whole pull field"; }
  void release_field() override {
    if (given_in_ == Memory::device) displacement_.release();
  }

  void check_wanted(const Maps& maps) const override {
    require(!maps.jacobian.voxels && !maps.owners.voxels && !maps.tetrahedra.voxels,
            "a pull field has no tetrahedra: no map of Jacobian determinants, owners or tetrahedra");
  }

  void map_box(const SlabBox& box, SlabWriter&) override {
    const auto voxels = static_cast<std::size_t>(box.count());
    const MappedVoxels to = mapped_.reserve(voxels, false);
    pull_kernel<<<blocks_for(box.count()), kThreads, 0, stream_>>>(frame_, box, to.mapped, to.offset);
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  PullFrame frame_;
  Geometry grid_;
  const glm::vec3* given_ = nullptr;  ///< the samples where the caller has them
  Memory given_in_ = Memory::host;
  std::vector<ShiftBounds> shifts_;       ///< of each slice of samples, where they were asked for
  DeviceBuffer<glm::vec3> displacement_;  ///< of a field on the host
  DeviceBuffer<unsigned long long> bad_;
};

}  // namespace

}  // namespace cuda_detail

std::unique_ptr<PullResampler> make_cuda_pull_resampler(const Geometry& output, int device, const Limits& limits) {
  return std::make_unique<cuda_detail::SampledPullResampler>(output, device, limits);
}

}  // namespace tetwarp
