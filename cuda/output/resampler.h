// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include "cuda/lattice/slab.h"
#include "cuda/output/slab_plan.h"
#include "deform/resampler.h"

namespace tetwarp::cuda_detail {

/// What forward and pull have in common. The output is made slab by slab, where not everything fits the device, and a
/// slab box by box, of which `map_box` says where voxels come from.
///
/// A slab is what parts of the field and of the sources are held for; a box bounds working space, and is copied to the
/// host while the next one is computed.
class CudaResampler : public Resampler {
 public:
  CudaResampler(Geometry output, int device, const Limits& limits);

  Region source_region(const Geometry& source, Region region) const override;
  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control) override;

 protected:
  virtual Region source_extent(const Geometry& source, const Region& region) const = 0;
  virtual void check_wanted(const Maps&) const {}
  virtual void map_box(const SlabBox& box, SlabWriter& writer) = 0;
  virtual void describe_field(Report&) const {}
  /// Device memory of a voxel that `map_box` works with.
  virtual std::int64_t work_bytes(const SlabWriter&) const { return Mapped::kBytes; }
  /// Whether voxels can be found and sampled in one go, and how.
  virtual bool can_write_plainly() const { return false; }
  virtual void write_plainly(const SlabBox&, SlabWriter&) {}

  /// Device memory for what must be held of a field on the host, for some slices of the output.
  virtual std::uint64_t field_bytes(const Slices& output) const = 0;
  virtual std::uint64_t held_field_bytes() const = 0;
  virtual const char* held_of_field() const = 0;  ///< "whole field", "part of the field"
  /// Whether only parts of the field are held, of which `hold_field` brings those for some slices of the output.
  virtual bool is_field_streamed() const { return false; }
  virtual void hold_field(const Slices&) {}
  /// Changes over to that. @return whether it can and did
  virtual bool stream_field(const Control&) { return false; }
  virtual void release_field() {}
  /// Before `slab_source` is asked for slabs of this field.
  virtual void prepare_slabs() = 0;
  /// Like `source_extent`, soon found: it may be larger.
  virtual Region slab_source(const Geometry& source, const Region& slab) const = 0;

  /// Device memory that fields, sources and results on the host may take together.
  std::uint64_t allowed_bytes() const;
  /// Whether a field may be held whole.
  bool may_hold(std::uint64_t bytes) const;
  /// Gives back what does not fit beside a field.
  void make_room_for_field(std::uint64_t bytes);

  int device_;
  bool ready_ = false;
  cudaStream_t stream_ = nullptr;  ///< of the latest call
  std::unique_ptr<Uploads> uploads_;
  Mapped mapped_;
  DeviceBuffer<Counts> counts_;                                ///< of the latest call
  std::uint64_t plainly_covered_ = 0, plainly_uncovered_ = 0;  ///< likewise, by `write_plainly`
  Paths paths_;                                                ///< likewise

 private:
  /// Of a source, the slices that a slab is sampled from.
  using SlicesOf = std::function<Slices(const ConstVolumeView& source)>;

  Counts write_region(const Region& region, const Control& control);
  bool writes_plainly() const { return can_write_plainly() && writer_->is_plain(); }
  std::int64_t most_in_box() const { return writer_->box_voxels(writes_plainly() ? 0 : work_bytes(*writer_)); }
  /// Decides on slabs, and makes room for them.
  std::int64_t plan(const Region& region, const Control& control);
  std::int64_t plan_parts(const Region& region, const Control& control);
  /// Gives back what would be too much, were all buffers as large as `needs`.
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
  bool in_parts_ = false;        ///< of the sources, only what a slab needs is held
  std::int64_t box_voxels_ = 0;  ///< as planned
};

}  // namespace tetwarp::cuda_detail
