#include "cuda/slab.h"

#include "cuda/pointer_check.h"
#include "deform/target_check.h"

namespace tetwarp::cuda_detail {

namespace {

/// Adds 1 for every thread of the warp whose condition holds.
__device__ void count(unsigned long long* counter, bool condition) {
  const unsigned active = __activemask();
  const unsigned votes = __ballot_sync(active, condition);
  if (votes != 0 && (threadIdx.x & 31) == __ffs(static_cast<int>(active)) - 1) {
    atomicAdd(counter, static_cast<unsigned long long>(__popc(votes)));
  }
}

struct DeviceSlices {
  long long *first, *last;  ///< one per output slice, or null
};

template <class V, Interpolation kInterpolation>
__global__ void sample_kernel(SamplePlan<V> plan, SlabBox slab, const std::uint8_t* mapped, const glm::vec3* offset,
                              Destination<V> output, std::uint8_t* coverage, DeviceSlices slices, Counts* counts) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= slab.count()) return;
  const glm::i64vec3 at = slab.voxel(n);
  const SampledVoxel<V> voxel = sample_voxel<V, kInterpolation>(plan, at, mapped[n] != 0, offset[n]);
  output.at(at) = voxel.value;
  if (coverage) coverage[n] = voxel.inside;
  if (counts) {
    count(&counts->covered, voxel.inside);
    count(&counts->uncovered, !voxel.inside);
    count(&counts->clamped, voxel.saturated);
    count(&counts->padded, voxel.padded);
  }
  if (slices.first && voxel.inside) {
    if (voxel.first_slice < slices.first[at.z]) atomicMin(&slices.first[at.z], voxel.first_slice);
    if (voxel.last_slice > slices.last[at.z]) atomicMax(&slices.last[at.z], voxel.last_slice);
  }
}

/// Where there is no target, the field alone says what is covered.
__global__ void count_kernel(SlabBox slab, const std::uint8_t* mapped, std::uint8_t* coverage, Counts* counts) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= slab.count()) return;
  coverage[n] = mapped[n];
  count(&counts->covered, mapped[n] != 0);
  count(&counts->uncovered, mapped[n] == 0);
}

__global__ void inverse_kernel(SlabBox slab, glm::dmat3 mm_from_index, const std::uint8_t* mapped,
                               const glm::vec3* offset, glm::vec3* inverse_mm) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= slab.count()) return;
  inverse_mm[n] = mapped[n] ? glm::vec3(mm_from_index * glm::dvec3(offset[n])) : glm::vec3(__int_as_float(0x7fc00000));
}

template <class V, class... Arguments>
void launch_sample(cudaStream_t stream, Interpolation interpolation, std::int64_t voxels, Arguments... arguments) {
  const unsigned blocks = blocks_for(voxels);
  switch (interpolation) {
    case Interpolation::nearest:
      sample_kernel<V, Interpolation::nearest><<<blocks, kThreads, 0, stream>>>(arguments...);
      break;
    case Interpolation::linear:
      sample_kernel<V, Interpolation::linear><<<blocks, kThreads, 0, stream>>>(arguments...);
      break;
    case Interpolation::cubic:
      sample_kernel<V, Interpolation::cubic><<<blocks, kThreads, 0, stream>>>(arguments...);
      break;
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace

struct SlabWriter::DeviceTarget {
  Target target;
  SourceRelation relation;
  const std::byte* source;
  DeviceBuffer<std::byte> uploaded;  ///< the source, where it was on the host
  DeviceBuffer<long long> first, last;
};

SlabWriter::SlabWriter(const Geometry& output, std::span<const Target> targets, const Maps& maps, cudaStream_t stream)
    : output_(output), maps_(maps), stream_(stream) {
  for (const VolumeView& map : {maps.coverage, maps.inverse_mm, maps.jacobian, maps.owners})
    require_memory(map.voxels, map.memory, "a map");
  for (const Target& target : targets) {
    auto on_device = std::make_unique<DeviceTarget>();
    on_device->target = target;
    on_device->relation = relate(*target.source.geometry, output);
    require_memory(target.source.voxels, target.source.memory, "the source");
    require_memory(target.output.voxels, target.output.memory, "the output");
    on_device->source = target.source.voxels;
    if (target.source.memory == Memory::host) {
      const auto bytes = static_cast<std::size_t>(voxel_count(target.source.buffered)) * size_bytes(target.source.type);
      on_device->uploaded.upload(target.source.voxels, bytes, stream_);
      on_device->source = on_device->uploaded.data();
    }
    if (!target.sampled_slices.empty()) {
      std::vector<long long> first, last;
      for (const SliceRange& range : target.sampled_slices) {
        first.push_back(range.first);
        last.push_back(range.last);
      }
      on_device->first.upload(first.data(), first.size(), stream_);
      on_device->last.upload(last.data(), last.size(), stream_);
    }
    targets_.push_back(std::move(on_device));
  }
}

SlabWriter::~SlabWriter() = default;

void SlabWriter::write(const SlabBox& slab, const Mapped& mapped, Counts* counts) {
  std::uint8_t* coverage = coverage_.reserve(static_cast<std::size_t>(slab.count()));
  for (std::size_t n = 0; n < targets_.size(); ++n) {
    write_target(*targets_[n], slab, mapped, n == 0 ? coverage : nullptr, n == 0 ? counts : nullptr);
  }
  if (targets_.empty()) {
    count_kernel<<<blocks_for(slab.count()), kThreads, 0, stream_>>>(slab, mapped.mapped.data(), coverage, counts);
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
  write_maps(slab, mapped);
}

void SlabWriter::write_target(DeviceTarget& on_device, const SlabBox& slab, const Mapped& mapped,
                              std::uint8_t* coverage, Counts* counts) {
  const Target& target = on_device.target;
  const DeviceSlices slices{on_device.first.data(), on_device.last.data()};
  dispatch(target.source.type, [&](auto voxel) {
    using V = decltype(voxel);
    const Destination<V> output = destination<V>(target, slab);
    const auto plan = plan_target(target, on_device.relation, reinterpret_cast<const V*>(on_device.source));
    launch_sample<V>(stream_, target.interpolation, slab.count(), plan, slab,
                     static_cast<const std::uint8_t*>(mapped.mapped.data()),
                     static_cast<const glm::vec3*>(mapped.offset.data()), output, coverage, slices, counts);
    if (target.output.memory == Memory::host) copy_out(target.output, slab, output.voxels);
  });
}

template <class V>
Destination<V> SlabWriter::destination(const Target& target, const SlabBox& slab) {
  if (target.output.memory == Memory::device) {
    const glm::i64vec3 held = target.output.buffered.end - target.output.buffered.begin;
    return {reinterpret_cast<V*>(target.output.voxels), target.output.buffered.begin, held.x, held.x * held.y};
  }
  V* buffer = reinterpret_cast<V*>(voxels_.reserve(static_cast<std::size_t>(slab.count()) * sizeof(V)));
  return {buffer, slab.begin, slab.size.x, slab.size.x * slab.size.y};
}

bool SlabWriter::is_plain() const {
  if (targets_.size() != 1 || maps_.coverage.voxels || maps_.inverse_mm.voxels || wants_jacobian() || wants_owners())
    return false;
  const Target& target = targets_.front()->target;
  const VoxelType type = target.source.type;
  const bool background_fits = dispatch(type, [&](auto voxel) {
    using V = decltype(voxel);
    return target.background >= double(std::numeric_limits<V>::lowest()) &&
           target.background <= double(std::numeric_limits<V>::max());
  });
  return background_fits && target.interpolation == Interpolation::linear && !target.padding &&
         target.sampled_slices.empty() && targets_.front()->relation.same_grid &&
         voxel_count(*target.source.geometry) < INT32_MAX && voxel_count(output_) < INT32_MAX &&
         (type == VoxelType::u8 || type == VoxelType::i16 || type == VoxelType::u16);
}

AnyVoxelSink SlabWriter::plain_sink(const SlabBox& slab) {
  const DeviceTarget& on_device = *targets_.front();
  const Target& target = on_device.target;
  const auto make = [&](auto voxel) {
    using V = decltype(voxel);
    const auto plan = plan_target(target, on_device.relation, reinterpret_cast<const V*>(on_device.source));
    const Destination<V> output = destination<V>(target, slab);
    const glm::i64vec3 &begin = plan.source.begin, &stride = plan.source.stride;
    return VoxelSink<V>{plan.source.voxels - (begin.z * stride.z + begin.y * stride.y + begin.x),
                        glm::ivec3(plan.source.size) - 1,
                        static_cast<int>(plan.source.stride.y),
                        static_cast<int>(plan.source.stride.z),
                        plan.background,
                        output.voxels - (output.begin.z * output.slice + output.begin.y * output.row + output.begin.x),
                        static_cast<int>(output.row),
                        static_cast<int>(output.slice)};
  };
  switch (target.source.type) {
    case VoxelType::u8: return make(std::uint8_t{});
    case VoxelType::u16: return make(std::uint16_t{});
    default: return make(std::int16_t{});
  }
}

void SlabWriter::finish_plain(const SlabBox& slab) {
  const Target& target = targets_.front()->target;
  if (target.output.memory == Memory::host) copy_out(target.output, slab, voxels_.data());
}

void SlabWriter::write_maps(const SlabBox& slab, const Mapped& mapped) {
  if (maps_.coverage.voxels) copy_out(maps_.coverage, slab, coverage_.data());
  if (maps_.inverse_mm.voxels) {
    glm::vec3* inverse_mm = inverse_mm_.reserve(static_cast<std::size_t>(slab.count()));
    inverse_kernel<<<blocks_for(slab.count()), kThreads, 0, stream_>>>(
        slab, point_from_index(output_).linear, mapped.mapped.data(), mapped.offset.data(), inverse_mm);
    TETWARP_CUDA_TRY(cudaGetLastError());
    copy_out(maps_.inverse_mm, slab, inverse_mm);
  }
  if (wants_jacobian()) copy_out(maps_.jacobian, slab, mapped.jacobian.data());
  if (wants_owners()) copy_out(maps_.owners, slab, mapped.owners.data());
}

/// From a buffer of the slab alone into its place in a view, on the host or the device.
void SlabWriter::copy_out(const VolumeView& view, const SlabBox& slab, const void* device) {
  const glm::i64vec3 held = view.buffered.end - view.buffered.begin, at = slab.begin - view.buffered.begin;
  const std::size_t voxel = size_bytes(view.type) * static_cast<std::size_t>(view.components);
  cudaMemcpy3DParms copy{};
  const auto pitched = [&](const void* bytes, const glm::i64vec3& size) {
    const auto width = static_cast<std::size_t>(size.x);
    return make_cudaPitchedPtr(const_cast<void*>(bytes), width * voxel, width, static_cast<std::size_t>(size.y));
  };
  copy.srcPtr = pitched(device, slab.size);
  copy.dstPtr = pitched(view.voxels, held);
  copy.dstPos = make_cudaPos(static_cast<std::size_t>(at.x) * voxel, static_cast<std::size_t>(at.y),
                             static_cast<std::size_t>(at.z));
  copy.extent = make_cudaExtent(static_cast<std::size_t>(slab.size.x) * voxel, static_cast<std::size_t>(slab.size.y),
                                static_cast<std::size_t>(slab.size.z));
  copy.kind = view.memory == Memory::host ? cudaMemcpyDeviceToHost : cudaMemcpyDeviceToDevice;
  TETWARP_CUDA_TRY(cudaMemcpy3DAsync(&copy, stream_));
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
}

}  // namespace tetwarp::cuda_detail
