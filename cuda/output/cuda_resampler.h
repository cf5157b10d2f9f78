// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include "cuda/lattice/slab.cuh"
#include "cuda/output/slab_plan.h"
#include "deform/resampler.h"

namespace tetwarp::cuda_detail {

/// Base of the resamplers of forward and pull fields. The output is made slab by slab where not everything fits the
/// device, and each slab box by box; `map_box` computes where the voxels of a box come from.
///
/// Parts of the field and of the sources are held for one slab. A box bounds the working space, and is copied to the
/// host while the next one is computed.
///
/// @tparam Base  ForwardResampler or PullResampler
template <class Base>
class CudaResampler : public Base {
 public:
  CudaResampler(const Geometry& output, int device, const Limits& limits);

  Region source_region(const Geometry& source, Region region) const override;
  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
                  const PartSink& finished) override;

 protected:
  virtual Region source_extent(const Geometry& source, const Region& region) const = 0;
  virtual void check_wanted(const Maps&) const {}
  virtual void map_box(const SlabBox& box, SlabWriter& writer) = 0;
  virtual void describe_field(Report&) const {}
  /// Device memory for each voxel on which `map_box` works.
  virtual std::int64_t work_bytes(const SlabWriter&) const { return Mapped::bytes(false); }
  /// Whether `write_plainly` can find and sample voxels in one pass.
  virtual bool can_write_plainly() const { return false; }
  virtual void write_plainly(const SlabBox&, SlabWriter&) {}

  /// Device memory for what must be held of a field in host memory, for some slices of the output.
  virtual std::uint64_t field_bytes(const Slices& output) const = 0;
  virtual std::uint64_t held_field_bytes() const = 0;
  virtual const char* held_of_field() const = 0;  ///< "whole field", "part of the field"
  /// Whether only parts of the field are held, which `hold_field` uploads for some slices of the output.
  virtual bool is_field_streamed() const { return false; }
  virtual void hold_field(const Slices&) {}
  /// Changes to holding parts of the field only.
  /// @return whether that was possible
  virtual bool stream_field(const Control&) { return false; }
  virtual void release_field() {}
  /// Called before `slab_source` is called for slabs of this field.
  virtual void prepare_slabs() = 0;
  /// A region that contains `source_region` and is found quickly.
  virtual Region slab_source(const Geometry& source, const Region& slab) const = 0;

  /// Device memory that fields, sources and results on the host may take together.
  std::uint64_t allowed_bytes() const;
  /// Whether so many bytes of a field may be held at once.
  bool may_hold(std::uint64_t bytes) const;
  /// Frees what does not fit beside a field of so many bytes.
  void make_room_for_field(std::uint64_t bytes);

  int device_;
  bool ready_ = false;
  cudaStream_t stream_ = nullptr;  ///< stream of the latest call
  std::unique_ptr<Uploads> uploads_;
  Mapped mapped_;
  DeviceBuffer<Counts> counts_;  ///< counts of the latest call
  /// Voxels that `write_plainly` covered and did not cover in the latest call.
  std::uint64_t plainly_covered_ = 0, plainly_uncovered_ = 0;
  Paths paths_;  ///< of the latest call

 private:
  /// The slices of a source from which a slab is sampled.
  using SlicesOf = std::function<Slices(const ConstVolumeView& source)>;

  Counts write_region(const Region& region, const Control& control, const PartSink& finished);
  bool writes_plainly() const { return can_write_plainly() && writer_->is_plain(); }
  std::int64_t most_in_box() const { return writer_->box_voxels(writes_plainly() ? 0 : work_bytes(*writer_)); }
  /// Decides on slabs, and makes room for them.
  std::int64_t plan(const Region& region, const Control& control);
  std::int64_t plan_parts(const Region& region, const Control& control);
  /// Frees buffers that would be too much if all were as large as `needs`.
  void make_room(const SlabNeeds& needs, std::uint64_t allowed);
  SlabNeeds needs_of(const Region& slab) const;
  SlicesOf source_slices(const Region& slab) const;
  template <class Done>
  void write_slab(const Region& slab, Done&& done);
  void write_box(const SlabBox& box, bool plain);
  SlabNeeds held() const;
  Report report_of(const Counts& counts, const Maps& maps) const;

  Limits limits_;
  std::unique_ptr<SlabWriter> writer_;
  bool counted_ = false;         ///< whether some box of the call was counted in `counts_`
  bool in_parts_ = false;        ///< whether only those parts of the sources are held that a slab needs
  std::int64_t box_voxels_ = 0;  ///< as planned
};

}  // namespace tetwarp::cuda_detail
