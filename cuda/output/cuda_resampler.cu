// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/output/cuda_resampler.h"

#include <algorithm>

#include "deform/target_check.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr std::uint64_t kLeastReserve = std::uint64_t{256} << 20;  ///< of a device's memory, for working space

/// Whole slices or, where one is too large, whole rows of them.
template <class Work>
void for_each_box(const Region& slab, std::int64_t voxels, Work&& work) {
  const glm::i64vec3 size = slab.end - slab.begin;
  const std::int64_t rows = std::clamp<std::int64_t>(voxels / size.x, 1, size.y);
  const std::int64_t slices = rows < size.y ? 1 : std::clamp<std::int64_t>(voxels / (size.x * size.y), 1, size.z);
  for (std::int64_t z = 0; z < size.z; z += slices) {
    for (std::int64_t y = 0; y < size.y; y += rows) {
      work(SlabBox{slab.begin + glm::i64vec3(0, y, z),
                   {size.x, std::min(rows, size.y - y), std::min(slices, size.z - z)}});
    }
  }
}

}  // namespace

template <class Base>
CudaResampler<Base>::CudaResampler(const Geometry& output, int device, const Limits& limits)
    : Base(output), device_(device), limits_(limits) {
  int count = 0;
  TETWARP_CUDA_TRY(cudaGetDeviceCount(&count));
  if (device < 0 || device >= count) {
    throw DeviceError("no CUDA device " + std::to_string(device) + ", " + std::to_string(count) +
                      " found; see tetwarp --version");
  }
  const DeviceScope scope(device);
  uploads_ = std::make_unique<Uploads>();
  writer_ = std::make_unique<SlabWriter>(output, device, *uploads_);
}

template <class Base>
Region CudaResampler<Base>::source_region(const Geometry& source, Region region) const {
  require(ready_, "source_region needs a field: call set_field first");
  region = intersection(region, whole(this->output()));
  return tetwarp::is_empty(region) ? Region{} : source_extent(source, region);
}

template <class Base>
Report CudaResampler<Base>::resample(Region region, std::span<const Target> targets, const Maps& maps,
                                     const Control& control, const PartSink& finished) {
  require(ready_, "resample needs a field: call set_field first");
  check_targets(*this, targets, region);
  check_maps(maps, this->output(), region);
  check_wanted(maps);
  plainly_covered_ = plainly_uncovered_ = 0;
  paths_ = {};
  if (tetwarp::is_empty(region)) return report_of({}, maps);
  const DeviceScope scope(device_);
  stream_ = static_cast<cudaStream_t>(control.stream);
  if (control.stop.stop_requested()) throw Cancelled();
  writer_->begin(targets, maps, region, stream_);
  try {
    return report_of(write_region(region, control, finished), maps);
  } catch (...) {
    writer_->wait_for_all();
    throw;
  }
}

template <class Base>
Counts CudaResampler<Base>::write_region(const Region& region, const Control& control, const PartSink& finished) {
  counted_ = false;
  const std::int64_t slices = plan(region, control);
  std::int64_t done = 0;
  for (std::int64_t z = region.begin.z; z < region.end.z; z += slices) {
    Region slab = region;
    slab.begin.z = z;
    slab.end.z = std::min(z + slices, region.end.z);
    write_slab(slab, [&](const SlabBox& box) {
      const glm::i64vec3 end = box.begin + box.size;
      if (finished && end.y == slab.end.y) {
        writer_->finish();
        finished({{slab.begin.x, slab.begin.y, box.begin.z}, end});
      }
      done += box.count();
      if (control.progress) control.progress(static_cast<double>(done) / static_cast<double>(voxel_count(region)));
      if (control.stop.stop_requested()) throw Cancelled();
    });
  }
  writer_->finish();
  Counts counts{};
  if (counted_) counts_.download(&counts, 1, stream_);  // waits for all that was queued
  return counts;
}

/// @return slices of a slab
template <class Base>
std::int64_t CudaResampler<Base>::plan(const Region& region, const Control& control) {
  const glm::i64vec3 size = region.end - region.begin;
  box_voxels_ = std::max(most_in_box(), size.x);
  in_parts_ = is_field_streamed();
  if (in_parts_) return plan_parts(region, control);
  const SlabNeeds all = needs_of(region), had = held();
  const bool fits_as_it_is = all.source <= had.source && all.output <= had.output;
  const std::uint64_t allowed = fits_as_it_is ? 0 : allowed_bytes();
  if (!fits_as_it_is && all.total() > allowed) {
    in_parts_ = true;
    return plan_parts(region, control);
  }
  if (!fits_as_it_is) make_room(all, allowed);
  const std::int64_t voxels = voxel_count(region);
  writer_->reserve(all.source, std::min(box_voxels_, voxels), voxels <= box_voxels_ ? 1 : 2);
  return size.z;
}

template <class Base>
std::int64_t CudaResampler<Base>::plan_parts(const Region& region, const Control& control) {
  const auto plan_now = [&](std::uint64_t allowed) {
    prepare_slabs();
    return plan_slabs(region.begin.z, region.end.z, allowed, [&](std::int64_t begin, std::int64_t end) {
      return needs_of({{region.begin.x, region.begin.y, begin}, {region.end.x, region.end.y, end}});
    });
  };
  std::uint64_t allowed = allowed_bytes();
  SlabPlan slabs = plan_now(allowed);
  if (slabs.slices == 0 && stream_field(control)) {
    allowed = allowed_bytes();
    slabs = plan_now(allowed);
  }
  if (slabs.slices == 0) refuse_slab(slabs.needs, held_of_field(), allowed);
  make_room(slabs.needs, allowed);
  const glm::i64vec3 size = region.end - region.begin;
  writer_->reserve(slabs.needs.source, std::min(box_voxels_, size.x * size.y * slabs.slices), 2);
  return slabs.slices;
}

template <class Base>
SlabNeeds CudaResampler<Base>::needs_of(const Region& slab) const {
  const std::int64_t voxels = voxel_count(slab);
  const int boxes = !in_parts_ && voxels <= box_voxels_ ? 1 : 2;
  return {field_bytes({slab.begin.z, slab.end.z}), writer_->source_bytes(source_slices(slab)),
          writer_->result_bytes(std::min(box_voxels_, voxels), boxes)};
}

template <class Base>
typename CudaResampler<Base>::SlicesOf CudaResampler<Base>::source_slices(const Region& slab) const {
  return [this, slab](const ConstVolumeView& source) -> Slices {
    const std::int64_t begin = source.buffered.begin.z, end = source.buffered.end.z;
    if (!in_parts_) return {begin, end};
    const Region extent = slab_source(*source.geometry, slab);
    const std::int64_t first = std::clamp(extent.begin.z, begin, end);
    return {first, std::clamp(extent.end.z, first, end)};
  };
}

template <class Base>
template <class Done>
void CudaResampler<Base>::write_slab(const Region& slab, Done&& done) {
  hold_field({slab.begin.z, slab.end.z});
  writer_->hold_sources(source_slices(slab));
  const bool plain = writes_plainly();
  const std::int64_t voxels = std::min(box_voxels_, most_in_box());  // what is found of a part may change it
  for_each_box(slab, std::min(voxels, voxel_count(slab)), [&](const SlabBox& box) {
    write_box(box, plain);
    done(box);
  });
}

template <class Base>
void CudaResampler<Base>::write_box(const SlabBox& box, bool plain) {
  writer_->begin_box(box);
  if (plain) {
    write_plainly(box, *writer_);
  } else {
    if (!counted_) counts_.fill(0, 1, stream_);
    counted_ = true;
    map_box(box, *writer_);
    writer_->write(box, mapped_.voxels(), counts_.data());
  }
  writer_->end_box(box);
}

template <class Base>
std::uint64_t CudaResampler<Base>::allowed_bytes() const {
  if (limits_.memory != 0) return limits_.memory;
  std::size_t free = 0, total = 0;
  TETWARP_CUDA_TRY(cudaMemGetInfo(&free, &total));
  const std::uint64_t ours = free + held().total(), reserve = std::max<std::uint64_t>(ours / 10, kLeastReserve);
  return ours > reserve ? ours - reserve : 0;
}

template <class Base>
bool CudaResampler<Base>::may_hold(std::uint64_t bytes) const {
  const bool held_already = limits_.memory == 0 && bytes <= held_field_bytes();
  return held_already || bytes <= allowed_bytes();
}

template <class Base>
void CudaResampler<Base>::make_room_for_field(std::uint64_t bytes) {
  if (bytes > held_field_bytes()) make_room({bytes, 0, 0}, allowed_bytes());
}

template <class Base>
void CudaResampler<Base>::make_room(const SlabNeeds& needs, std::uint64_t allowed) {
  if (larger(held(), needs).total() <= allowed) return;
  writer_->release();
  if (larger(held(), needs).total() > allowed) release_field();
}

template <class Base>
SlabNeeds CudaResampler<Base>::held() const {
  return {held_field_bytes(), writer_->held_source_bytes(), writer_->held_result_bytes()};
}

template <class Base>
Report CudaResampler<Base>::report_of(const Counts& counts, const Maps& maps) const {
  Report report;
  report.covered = counts.covered + plainly_covered_;
  report.uncovered = counts.uncovered + plainly_uncovered_;
  report.clamped = counts.clamped;
  report.padded = counts.padded;
  report.conflicts = counts.conflicts;
  if (maps.owners.voxels) report.multiply_owned = counts.multiply_owned;
  report.paths = paths_;
  describe_field(report);
  return report;
}

template class CudaResampler<ForwardResampler>;
template class CudaResampler<PullResampler>;

}  // namespace tetwarp::cuda_detail
