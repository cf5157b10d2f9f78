// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/lattice/slab.cuh"

#include <algorithm>

#include "cuda/lattice/slab_kernels.cuh"
#include "cuda/runtime/pointer_check.h"
#include "deform/target_check.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr std::int64_t kPlainVoxels = std::int64_t{1} << 30;   ///< of a box, where nothing is kept of each
constexpr std::int64_t kWorkBytes = std::int64_t{128} << 20;   ///< otherwise: of what is kept
constexpr std::int64_t kResultBytes = std::int64_t{32} << 20;  ///< of a box, where results wait to be copied

/// Where the next array may begin.
std::size_t aligned(std::size_t bytes) { return (bytes + 255) / 256 * 256; }

template <class View>
std::size_t voxel_bytes(const View& view) {
  return size_bytes(view.type) * static_cast<std::size_t>(view.components);
}

/// Calls with a voxel of a type that sinks sample.
template <class Work>
auto dispatch_plain(VoxelType type, Work&& work) {
  switch (type) {
    case VoxelType::u8: return work(std::uint8_t{});
    case VoxelType::u16: return work(std::uint16_t{});
    default: return work(std::int16_t{});
  }
}

/// Whether the same voxels of two volumes on one grid are held, in the same kind of memory.
template <class View>
bool lie_alike(const View& a, const View& b) {
  return a.memory == b.memory && a.buffered == b.buffered;
}

std::size_t bytes_of(const ConstVolumeView& source, const Slices& slices) {
  const glm::i64vec3 held = source.buffered.end - source.buffered.begin;
  return static_cast<std::size_t>(held.x * held.y * (slices.end - slices.begin)) * voxel_bytes(source);
}

}  // namespace

void SlabWriter::begin(std::span<const Target> targets, const Maps& maps, const Region& region, cudaStream_t stream) {
  maps_ = maps;
  const Region& held = maps.tetrahedra.buffered;
  tetrahedra_in_place_ = maps.tetrahedra.voxels && maps.tetrahedra.memory == Memory::device &&
                         held.begin.x == region.begin.x && held.end.x == region.end.x &&
                         held.begin.y == region.begin.y && held.end.y == region.end.y;
  stream_ = stream;
  for (const VolumeView& map : {maps.coverage, maps.inverse_mm, maps.jacobian, maps.owners, maps.tetrahedra})
    require_memory(map.voxels, map.memory, "a map");
  while (kept_.size() < targets.size()) kept_.push_back(std::make_unique<DeviceTarget>());
  targets_ = std::span(kept_).first(targets.size());
  for (std::size_t n = 0; n < targets.size(); ++n) {
    DeviceTarget& on_device = *targets_[n];
    const Target& target = on_device.target = targets[n];
    on_device.source = target.source;
    const std::vector<double> slices = uneven_slices(*target.source.geometry);
    if (!slices.empty()) on_device.slices.upload(slices.data(), slices.size(), stream_);
    on_device.relation = relate(*target.source.geometry, output_, slices.empty() ? nullptr : on_device.slices.data());
    require_memory(target.source.voxels, target.source.memory, "the source");
    require_memory(target.output.voxels, target.output.memory, "the output");
    std::vector<long long> first, last;
    for (const SliceRange& range : target.sampled_slices) {
      first.push_back(range.first);
      last.push_back(range.last);
    }
    if (first.empty()) continue;
    on_device.first.upload(first.data(), first.size(), stream_);
    on_device.last.upload(last.data(), last.size(), stream_);
  }
}

bool SlabWriter::is_plain() const {
  const bool wants_map = maps_.coverage.voxels || maps_.inverse_mm.voxels || wants_of_owners();
  return !wants_map && !targets_.empty() && targets_.size() <= kMostSinkVolumes && voxel_count(output_) < INT32_MAX &&
         std::all_of(targets_.begin(), targets_.end(), [&](const auto& target) { return is_plain(*target); });
}

bool SlabWriter::is_plain(const DeviceTarget& on_device) const {
  const Target &target = on_device.target, &first = targets_.front()->target;
  const VoxelType type = target.source.type;
  const bool background_fits = dispatch(type, [&](auto voxel) {
    using V = decltype(voxel);
    return target.background >= double(std::numeric_limits<V>::lowest()) &&
           target.background <= double(std::numeric_limits<V>::max());
  });
  return background_fits && on_device.relation.same_grid && !target.padding && target.sampled_slices.empty() &&
         target.source.components == 1 && (type == VoxelType::u8 || type == VoxelType::i16 || type == VoxelType::u16) &&
         (target.interpolation == Interpolation::linear || target.interpolation == Interpolation::vote) &&
         lie_alike(target.source, first.source) && lie_alike(target.output, first.output);
}

bool SlabWriter::has_results_on_host() const {
  for (const VolumeView& map : {maps_.coverage, maps_.inverse_mm, maps_.jacobian, maps_.owners, maps_.tetrahedra}) {
    if (map.voxels && map.memory == Memory::host) return true;
  }
  return std::any_of(targets_.begin(), targets_.end(),
                     [](const auto& target) { return target->target.output.memory == Memory::host; });
}

std::int64_t SlabWriter::box_voxels(std::int64_t work_bytes) const {
  constexpr std::int64_t kGroup = 1 << 10;
  const std::int64_t most = work_bytes == 0 ? kPlainVoxels : kWorkBytes / work_bytes;
  const auto group_bytes = static_cast<std::int64_t>(layout(kGroup).bytes);
  return group_bytes == 0 ? most : std::min(most, kResultBytes / group_bytes * kGroup);
}

SlabWriter::Layout SlabWriter::layout(std::int64_t voxels) const {
  Layout layout;
  const auto add = [&](std::size_t voxel_bytes) {
    const std::size_t begin = layout.bytes;
    layout.bytes += aligned(voxel_bytes * static_cast<std::size_t>(voxels));
    return begin;
  };
  for (const auto& on_device : targets_) {
    const VolumeView& output = on_device->target.output;
    layout.voxels.push_back(output.memory == Memory::host ? add(voxel_bytes(output)) : Layout::kNone);
  }
  if (maps_.coverage.voxels) layout.coverage = add(sizeof(std::uint8_t));
  if (maps_.inverse_mm.voxels) layout.inverse_mm = add(sizeof(glm::vec3));
  if (maps_.jacobian.voxels) layout.jacobian = add(sizeof(float));
  if (maps_.owners.voxels) layout.owners = add(sizeof(std::uint16_t));
  if (maps_.tetrahedra.voxels && !tetrahedra_in_place_) layout.tetrahedra = add(sizeof(std::uint32_t));
  return layout;
}

std::uint64_t SlabWriter::source_bytes(const std::function<Slices(const ConstVolumeView& source)>& slices_of) const {
  std::uint64_t bytes = 0;
  for (const auto& on_device : targets_) {
    const ConstVolumeView& source = on_device->source;
    if (source.memory == Memory::host) bytes += aligned(bytes_of(source, slices_of(source)));
  }
  return bytes;
}

void SlabWriter::release() {
  sources_.release();
  results_.release();
}

void SlabWriter::reserve(std::uint64_t source_bytes, std::int64_t box_voxels, int boxes) {
  sources_.reserve(source_bytes);
  boxes_ = boxes;
  box_bytes_ = layout(box_voxels).bytes;
  results_.reserve(static_cast<std::size_t>(boxes) * box_bytes_);
}

void SlabWriter::hold_sources(const std::function<Slices(const ConstVolumeView& source)>& slices_of) {
  std::byte* to = sources_.reserve(source_bytes(slices_of));
  for (const auto& on_device : targets_) {
    const ConstVolumeView& source = on_device->source;
    if (source.memory == Memory::device) continue;
    const Slices slices = slices_of(source);
    const std::size_t bytes = bytes_of(source, slices);
    uploads_.copy(to, source.voxels + bytes_of(source, {source.buffered.begin.z, slices.begin}), bytes, stream_);
    ConstVolumeView& held = on_device->target.source;
    held.voxels = to;
    held.memory = Memory::device;
    held.buffered.begin.z = slices.begin;
    held.buffered.end.z = slices.end;
    to += aligned(bytes);
  }
}

std::uint32_t* SlabWriter::tetrahedra(const SlabBox& box) const {
  if (!tetrahedra_in_place_) return place<std::uint32_t>(layout_.tetrahedra);
  return reinterpret_cast<std::uint32_t*>(maps_.tetrahedra.voxels) + buffer_index(maps_.tetrahedra, box.begin);
}

void SlabWriter::begin_box(const SlabBox& box) {
  current_ = boxes_ == 1 ? 0 : 1 - current_;
  if (has_results_on_host()) copied_[current_].hold_back(stream_);
  layout_ = layout(box.count());
}

void SlabWriter::write(const SlabBox& box, const MappedVoxels& mapped, Counts* counts) {
  auto* coverage = place<std::uint8_t>(layout_.coverage);
  for (std::size_t n = 0; n < targets_.size(); ++n)
    write_target(n, box, mapped, n == 0 ? coverage : nullptr, n == 0 ? counts : nullptr);
  if (targets_.empty()) {
    count_kernel<<<blocks_for(box.count()), kThreads, 0, stream_>>>(box, mapped.mapped, coverage, counts);
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
  if (maps_.inverse_mm.voxels) {
    inverse_kernel<<<blocks_for(box.count()), kThreads, 0, stream_>>>(box, point_from_index(output_).linear, mapped,
                                                                      place<glm::vec3>(layout_.inverse_mm));
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
}

void SlabWriter::write_target(std::size_t number, const SlabBox& box, const MappedVoxels& mapped,
                              std::uint8_t* coverage, Counts* counts) {
  const DeviceTarget& on_device = *targets_[number];
  const Target& target = on_device.target;
  const bool slices_wanted = !target.sampled_slices.empty();
  const DeviceSlices slices{slices_wanted ? on_device.first.data() : nullptr,
                            slices_wanted ? on_device.last.data() : nullptr};
  dispatch(target.source.type, [&](auto voxel) {
    using V = decltype(voxel);
    const auto plan = plan_target(target, on_device.relation, reinterpret_cast<const V*>(target.source.voxels));
    launch_sample<V>(stream_, target.interpolation, box.count(), plan, target.source.components, box, mapped,
                     destination<V>(number, box), coverage, slices, counts);
  });
}

template <class V>
Destination<V> SlabWriter::destination(std::size_t number, const SlabBox& box) {
  const VolumeView& output = targets_[number]->target.output;
  if (output.memory == Memory::device) {
    const glm::i64vec3 held = output.buffered.end - output.buffered.begin;
    return {reinterpret_cast<V*>(output.voxels), output.buffered.begin, held.x, held.x * held.y};
  }
  return {place<V>(layout_.voxels[number]), box.begin, box.size.x, box.size.x * box.size.y};
}

/// Of a plain target: where its voxel (0, 0, 0) would be, were it held.
template <class V>
SlabWriter::PlainVolume<V> SlabWriter::plain_volume(std::size_t number, const SlabBox& box) {
  const DeviceTarget& on_device = *targets_[number];
  const Target& target = on_device.target;
  const auto plan = plan_target(target, on_device.relation, reinterpret_cast<const V*>(target.source.voxels));
  const Destination<V> output = destination<V>(number, box);
  const glm::i64vec3 &begin = plan.source.begin, &stride = plan.source.stride;
  return {plan.source.voxels - (begin.z * stride.z + begin.y * stride.y + begin.x), plan.background,
          output.voxels - (output.begin.z * output.slice + output.begin.y * output.row + output.begin.x)};
}

template <class V>
SinkLayout SlabWriter::sink_layout(const SlabBox& box) {
  const Target& target = targets_.front()->target;
  const glm::i64vec3 held = target.source.buffered.end - target.source.buffered.begin;
  const Destination<V> output = destination<V>(0, box);
  return {glm::ivec3(target.source.geometry->size) - 1, static_cast<int>(held.x), static_cast<int>(held.x * held.y),
          static_cast<int>(output.row), static_cast<int>(output.slice)};
}

template <class V, Lerp kRounding>
VolumesSink<V, kRounding> SlabWriter::volumes_sink(const SlabBox& box) {
  VolumesSink<V, kRounding> sink{};
  for (const auto& on_device : targets_) {
    const Target& target = on_device->target;
    dispatch_plain(target.source.type, [&](auto voxel) {
      using T = decltype(voxel);
      const auto number = static_cast<std::size_t>(sink.count);
      const PlainVolume<T> volume = plain_volume<T>(number, box);
      if (number == 0) static_cast<SinkLayout&>(sink) = sink_layout<T>(box);
      sink.volumes[sink.count++] = {volume.source, volume.output, target.source.type,
                                    target.interpolation == Interpolation::vote, volume.background};
    });
  }
  return sink;
}

template <Lerp kRounding>
AnyVoxelSink<kRounding> SlabWriter::plain_sink(const SlabBox& box) {
  const Target& first = targets_.front()->target;
  const auto make = [&](auto voxel) -> AnyVoxelSink<kRounding> {
    using V = decltype(voxel);
    const PlainVolume<V> volume = plain_volume<V>(0, box);
    return VoxelSink<V, kRounding>{sink_layout<V>(box), volume.source, volume.background, volume.output};
  };
  const auto holds_all = [&](const auto& condition) {
    return std::all_of(targets_.begin(), targets_.end(), [&](const auto& of) { return condition(of->target); });
  };
  if (!holds_all([](const Target& target) { return target.interpolation == Interpolation::linear; }))
    return volumes_sink<void, kRounding>(box);
  if (targets_.size() == 1) return dispatch_plain(first.source.type, make);
  if (!holds_all([](const Target& target) { return target.source.type == VoxelType::i16; }))
    return volumes_sink<void, kRounding>(box);
  return volumes_sink<std::int16_t, kRounding>(box);
}

template AnyVoxelSink<Lerp::separate> SlabWriter::plain_sink(const SlabBox&);
template AnyVoxelSink<Lerp::fused> SlabWriter::plain_sink(const SlabBox&);

void SlabWriter::end_box(const SlabBox& box) {
  const bool on_host = has_results_on_host();
  if (on_host) {
    computed_.record(stream_);
    computed_.hold_back(downloads_.stream());
  }
  for (std::size_t n = 0; n < targets_.size(); ++n) give(targets_[n]->target.output, box, layout_.voxels[n]);
  give(maps_.coverage, box, layout_.coverage);
  give(maps_.inverse_mm, box, layout_.inverse_mm);
  give(maps_.jacobian, box, layout_.jacobian);
  give(maps_.owners, box, layout_.owners);
  give(maps_.tetrahedra, box, layout_.tetrahedra);
  if (on_host) copied_[current_].record(downloads_.stream());
}

void SlabWriter::give(const VolumeView& view, const SlabBox& box, std::size_t offset) {
  const auto* from = place<std::byte>(offset);
  if (!from) return;
  const Region region{box.begin, box.begin + box.size};
  if (view.memory == Memory::host) {
    downloads_.copy(view, region, from);
  } else {
    copy_box(view, region, from, stream_);
  }
}

void SlabWriter::finish() {
  for (const auto& on_device : targets_) {
    const std::span<SliceRange> ranges = on_device->target.sampled_slices;
    if (ranges.empty()) continue;
    std::vector<long long> first(ranges.size()), last(ranges.size());
    on_device->first.download(first.data(), first.size(), stream_);
    on_device->last.download(last.data(), last.size(), stream_);
    for (std::size_t k = 0; k < ranges.size(); ++k) ranges[k] = {first[k], last[k]};
  }
  if (has_results_on_host()) downloads_.finish();
}

void SlabWriter::wait_for_all() noexcept {
  cudaStreamSynchronize(stream_);
  try {
    downloads_.finish();
  } catch (...) {  // what failed first is on its way already
  }
}

}  // namespace tetwarp::cuda_detail
