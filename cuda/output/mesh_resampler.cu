// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/output/mesh_resampler.h"

#include <algorithm>
#include <glm/common.hpp>

#include "cuda/output/cuda_resampler.h"
#include "cuda/owners/gather.cuh"
#include "cuda/owners/mesh_raster.cuh"
#include "deform/target_check.h"

namespace tetwarp::cuda_detail {

namespace {

/// What is known of the voxels of a box, and where it goes; a value for each voxel, in their order.
struct VoxelMapping {
  const unsigned* owner;         ///< lowest number of an owner, or kNoTetrahedron
  const unsigned* at_rest;       ///< owner in the undeformed mesh; null: nothing stays outside
  const std::uint16_t* several;  ///< number of owners; null: not wanted
  MappedVoxels places;           ///< written
  float* jacobian;               ///< written: determinant of its owner, NaN where nobody owns it; null: not wanted
  std::uint32_t* tetrahedra;     ///< written: `owner`; null: not wanted
};

/// From the owner of each voxel to where it comes from; voxels outside the undeformed mesh may stay where they are. A
/// thread a voxel.
///
/// @param of      read and written, as its members say
/// @param counts  conflicts and voxels with several owners are added
__global__ void map_mesh_voxels_kernel(MeshRaster::View mesh, SlabBox box, VoxelMapping of, Counts* counts) {
  const std::int64_t n = thread_of_grid();
  if (n >= box.count()) return;
  const glm::i64vec3 voxel = box.voxel(n);
  const unsigned number = of.owner[n];
  const bool owned = number != kNoTetrahedron, outside = of.at_rest && of.at_rest[n] == kNoTetrahedron;
  of.places.mapped[n] = owned || outside;
  of.places.put_nothing(n);
  if (of.tetrahedra) of.tetrahedra[n] = number;
  if (of.jacobian) of.jacobian[n] = owned || !outside ? __int_as_float(0x7fc00000) : 1.0f;
  if (owned) {
    const Tetrahedron t = mesh.tetrahedron(number);
    of.places.put(n, t, voxel, mesh.nudge.signs(voxel));
    if (of.jacobian) of.jacobian[n] = forward_jacobian(t);
    if (outside) atomicAdd(&counts->conflicts, 1ULL);
  }
  if (of.several && of.several[n] > 1) atomicAdd(&counts->multiply_owned, 1ULL);
}

class MeshResampler final : public CudaResampler<ForwardResampler> {
 public:
  using CudaResampler::CudaResampler;

  void set_field(const FieldView& field, const FieldOptions&, const Control& control) override {
    ready_ = false;
    mesh_ = snap_mesh(output(), field, control);
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    stays_outside_ = field.outside == Outside::rest;
    const bool wants_rest = field.outside != Outside::background;
    const std::uint64_t bytes = (wants_rest ? 2 : 1) * MeshRaster::bytes_of(mesh_);
    if (!may_hold(bytes)) refuse_field(bytes, allowed_bytes());
    make_room_for_field(bytes);
    raster_.set(mesh_, output(), stream_);
    if (wants_rest) rest_.set(undeformed(mesh_), output(), stream_);
    if (field.outside == Outside::refuse) require_reach(control);
    ready_ = true;
  }

 private:
  /// @throws InputError unless the undeformed mesh reaches over the whole output
  void require_reach(const Control& control) {
    const glm::i64vec3& size = output().size;
    const std::int64_t slices = std::clamp<std::int64_t>((std::int64_t{1} << 30) / (size.x * size.y), 1, size.z);
    std::int64_t voxels = 0, lowest = INT64_MAX;
    for (std::int64_t z = 0; z < size.z; z += slices) {
      if (control.stop.stop_requested()) throw Cancelled();
      const SlabBox box{{0, 0, z}, {size.x, size.y, std::min(slices, size.z - z)}};
      unsigned long long found[2] = {0, ~0ULL};
      holes_.upload(found, 2, stream_);
      rest_.run(box, HoleSink{box, holes_.data()}, stream_);
      holes_.download(found, 2, stream_);
      if (found[0] == 0) continue;
      voxels += static_cast<std::int64_t>(found[0]);
      lowest = std::min(lowest, z * size.x * size.y + static_cast<std::int64_t>(found[1]));
    }
    if (voxels != 0) refuse_mesh_reach(output(), voxels, lowest);
  }

  Region source_extent(const Geometry& source, const Region& region) const override {
    return mesh_source_region(mesh_, stays_outside_, output(), source, region);
  }
  void prepare_slabs() override {}
  Region slab_source(const Geometry& source, const Region& slab) const override { return source_extent(source, slab); }

  std::uint64_t field_bytes(const Slices&) const override { return held_field_bytes(); }
  std::uint64_t held_field_bytes() const override { return raster_.held_bytes() + rest_.held_bytes(); }
  const char* held_of_field() const override { return "whole mesh"; }

  /// Whether 32 bits hold what tiles compute.
  bool fits_tiles() const { return !mesh_.coarse || mesh_.most_moved < kFarForInt32; }
  bool can_write_plainly() const override { return !stays_outside_ && fits_tiles(); }
  std::int64_t work_bytes(const SlabWriter&) const override {
    return Mapped::bytes(mesh_.coarse) + std::int64_t{2 * sizeof(unsigned)};
  }

  void write_plainly(const SlabBox& box, SlabWriter& writer) override {
    const auto run = [&](const auto& sink) { raster_.run(box, sink, stream_); };
    with_rounding(mesh_.coarse,
                  [&](auto rounding) { std::visit(run, writer.plain_sink<decltype(rounding)::value>(box)); });
    const std::uint64_t covered = raster_.covered(stream_);
    plainly_covered_ += covered;
    plainly_uncovered_ += static_cast<std::uint64_t>(box.count()) - covered;
    paths_.claimed += static_cast<std::uint64_t>(box.count());
  }

  void map_box(const SlabBox& box, SlabWriter& writer) override {
    const auto voxels = static_cast<std::size_t>(box.count());
    paths_.claimed += static_cast<std::uint64_t>(voxels);
    const MappedVoxels to = mapped_.reserve(voxels, mesh_.coarse);
    if (!stays_outside_ && !writer.wants_of_owners() && fits_tiles()) {
      return with_rounding(mesh_.coarse, [&](auto rounding) {
        raster_.run(box, offset_sink<decltype(rounding)::value>(box, to), stream_);
      });
    }
    raster_.run(box, OwnerSink{box, owner_.reserve(voxels), writer.owners()}, stream_);
    if (stays_outside_) rest_.run(box, OwnerSink{box, at_rest_.reserve(voxels), nullptr}, stream_);
    const VoxelMapping mapping{owner_.data(),     stays_outside_ ? at_rest_.data() : nullptr,
                               writer.owners(),   to,
                               writer.jacobian(), writer.tetrahedra(box)};
    map_mesh_voxels_kernel<<<blocks_for(box.count()), kThreads, 0, stream_>>>(raster_.view(), box, mapping,
                                                                              counts_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  void describe_field(Report& report) const override { mesh_.describe(report); }

  SnappedMesh mesh_;
  MeshRaster raster_, rest_;  ///< deformed; and undeformed, where it matters what lies outside
  DeviceBuffer<unsigned> owner_, at_rest_;
  DeviceBuffer<unsigned long long> holes_;
  bool stays_outside_ = false;
};

}  // namespace

std::unique_ptr<ForwardResampler> make_mesh_resampler(const Geometry& output, int device, const Limits& limits) {
  return std::make_unique<MeshResampler>(output, device, limits);
}

}  // namespace tetwarp::cuda_detail
