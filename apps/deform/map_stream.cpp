// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/map_stream.h"

#include <algorithm>

#include "apps/cli/in_background.h"

namespace tetwarp::apps {

namespace {

constexpr std::int64_t kSlabVoxels = std::int64_t{1} << 23;
constexpr std::int64_t kLayer = 32;  ///< slices that the CPU works on at a time (deform/cpu/tiles.h)

/// What a map is asked for as, without voxels.
VolumeView shape_of(VolumeView Maps::*map) {
  VolumeView shape;
  shape.type = map == &Maps::coverage ? VoxelType::u8 : map == &Maps::owners ? VoxelType::u16 : VoxelType::f32;
  shape.components = map == &Maps::inverse_mm ? 3 : 1;
  return shape;
}

std::uint64_t voxel_bytes(const VolumeView& shape) {
  return static_cast<std::uint64_t>(shape.components) * size_bytes(shape.type);
}

/// In whole slices; at least one, for a view of nothing is refused.
ConstVolumeView cut(const ConstVolumeView& source, const Region& needed) {
  ConstVolumeView part = source;
  const std::int64_t slices = source.geometry->size.z;
  part.buffered.begin.z = std::clamp<std::int64_t>(needed.begin.z, 0, slices - 1);
  part.buffered.end.z = std::clamp(needed.end.z, part.buffered.begin.z + 1, slices);
  const auto slice_bytes = static_cast<std::size_t>(source.geometry->size.x * source.geometry->size.y) *
                           static_cast<std::size_t>(source.components) * size_bytes(source.type);
  part.voxels += static_cast<std::size_t>(part.buffered.begin.z) * slice_bytes;
  return part;
}

}  // namespace

std::int64_t MapStream::slab_slices(const Geometry& grid) {
  const std::int64_t slice = grid.size.x * grid.size.y,
                     layers = std::max<std::int64_t>(kSlabVoxels / slice / kLayer, 1);
  return std::min(layers * kLayer, grid.size.z);
}

std::uint64_t MapStream::bytes(const Geometry& grid, VolumeView Maps::*map, bool written) {
  const std::int64_t slices = std::min(slab_slices(grid) * (written ? 2 : 1), grid.size.z);
  return static_cast<std::uint64_t>(grid.size.x * grid.size.y * slices) * voxel_bytes(shape_of(map));
}

void MapStream::add(VolumeView Maps::*map, std::unique_ptr<ImageWriter> writer) {
  maps_.push_back({map, std::move(writer)});
}

void MapStream::run(const std::function<void(const Region&, const Maps&)>& make) {
  if (maps_.empty()) return make(whole(grid_), {});
  const std::int64_t slices = slab_slices(grid_);
  std::size_t number = 0;
  for (std::int64_t k = 0; k < grid_.size.z; k += slices, ++number) {
    Region slab = whole(grid_);
    slab.begin.z = k;
    slab.end.z = std::min(k + slices, grid_.size.z);
    const Maps maps = maps_of(slab, number);
    make(slab, maps);
    if (writing_.valid()) writing_.get();
    writing_ = in_background([this, maps] { write(maps); });
  }
  writing_.get();
  outputs_.write([&] {
    for (const Map& map : maps_)
      if (map.writer) map.writer->finish();
  });
}

Maps MapStream::maps_of(const Region& slab, std::size_t number) {
  Maps maps;
  for (Map& map : maps_) {
    VolumeView view = shape_of(map.place);
    std::unique_ptr<std::byte[]>& voxels = map.slabs[map.writer ? number % 2 : 0];
    if (!voxels) voxels.reset(new std::byte[static_cast<std::size_t>(voxel_count(slab)) * voxel_bytes(view)]);
    view.geometry = &grid_;
    view.buffered = slab;
    view.voxels = voxels.get();
    maps.*map.place = view;
  }
  return maps;
}

void MapStream::write(const Maps& maps) {
  outputs_.write([&] {
    for (const Map& map : maps_)
      if (map.writer) map.writer->write(maps.*map.place);
  });
}

Report resample_slab(Resampler& resampler, const Region& slab, std::vector<Target> targets, const Maps& maps,
                     const Control& control, const PartSink& finished) {
  const Region all = whole(resampler.output());
  if (slab == all) return resampler.resample(slab, targets, maps, control, finished);
  for (Target& target : targets)
    target.source = cut(target.source, resampler.source_region(*target.source.geometry, slab));
  Control of_slab = control;
  if (control.progress) {
    of_slab.progress = [&](double part) {
      const double slices = static_cast<double>(slab.begin.z) + part * static_cast<double>(slab.end.z - slab.begin.z);
      control.progress(slices / static_cast<double>(all.end.z));
    };
  }
  return resampler.resample(slab, targets, maps, of_slab, finished);
}

}  // namespace tetwarp::apps
