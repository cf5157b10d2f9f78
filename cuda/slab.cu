#include "cuda/slab.h"
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
                              V* output, std::uint8_t* coverage, DeviceSlices slices, Counts* counts) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= slab.count()) return;
  const glm::i64vec3 at = slab.voxel(n);
  const SampledVoxel<V> voxel = sample_voxel<V, kInterpolation>(plan, at, mapped[n] != 0, offset[n]);
  output[n] = voxel.value;
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
void launch_sample(Interpolation interpolation, std::int64_t voxels, Arguments... arguments) {
  const unsigned blocks = blocks_for(voxels);
  switch (interpolation) {
    case Interpolation::nearest: sample_kernel<V, Interpolation::nearest><<<blocks, kThreads>>>(arguments...); break;
    case Interpolation::linear: sample_kernel<V, Interpolation::linear><<<blocks, kThreads>>>(arguments...); break;
    case Interpolation::cubic: sample_kernel<V, Interpolation::cubic><<<blocks, kThreads>>>(arguments...); break;
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace

struct SlabWriter::DeviceTarget {
  Target target;
  SourceRelation relation;
  DeviceBuffer<std::byte> source;
  DeviceBuffer<long long> first, last;
};

SlabWriter::SlabWriter(const Geometry& output, std::span<const Target> targets, const Maps& maps)
    : output_(output), maps_(maps) {
  for (const Target& target : targets) {
    auto on_device = std::make_unique<DeviceTarget>();
    on_device->target = target;
    on_device->relation = relate(*target.source.geometry, output);
    const auto bytes = static_cast<std::size_t>(voxel_count(target.source.buffered)) * size_bytes(target.source.type);
    on_device->source.upload(target.source.voxels, bytes);
    if (!target.sampled_slices.empty()) {
      std::vector<long long> first, last;
      for (const SliceRange& range : target.sampled_slices) {
        first.push_back(range.first);
        last.push_back(range.last);
      }
      on_device->first.upload(first.data(), first.size());
      on_device->last.upload(last.data(), last.size());
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
    count_kernel<<<blocks_for(slab.count()), kThreads>>>(slab, mapped.mapped.data(), coverage, counts);
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
    V* output = reinterpret_cast<V*>(voxels_.reserve(static_cast<std::size_t>(slab.count()) * sizeof(V)));
    const auto plan = plan_target(target, on_device.relation, reinterpret_cast<const V*>(on_device.source.data()));
    launch_sample<V>(target.interpolation, slab.count(), plan, slab,
                     static_cast<const std::uint8_t*>(mapped.mapped.data()),
                     static_cast<const glm::vec3*>(mapped.offset.data()), output, coverage, slices, counts);
    copy_out(target.output, slab, output, 1);
  });
}

void SlabWriter::write_maps(const SlabBox& slab, const Mapped& mapped) {
  if (maps_.coverage.voxels) copy_out(maps_.coverage, slab, coverage_.data(), 1);
  if (maps_.inverse_mm.voxels) {
    glm::vec3* inverse_mm = inverse_mm_.reserve(static_cast<std::size_t>(slab.count()));
    inverse_kernel<<<blocks_for(slab.count()), kThreads>>>(slab, point_from_index(output_).linear, mapped.mapped.data(),
                                                           mapped.offset.data(), inverse_mm);
    TETWARP_CUDA_TRY(cudaGetLastError());
    copy_out(maps_.inverse_mm, slab, reinterpret_cast<const float*>(inverse_mm), 3);
  }
  if (wants_jacobian()) copy_out(maps_.jacobian, slab, mapped.jacobian.data(), 1);
  if (wants_owners()) copy_out(maps_.owners, slab, mapped.owners.data(), 1);
}

template <class V>
void SlabWriter::copy_out(const VolumeView& view, const SlabBox& slab, const V* device, int components) {
  const auto row = static_cast<std::size_t>(slab.size.x * components);
  staging_.resize(static_cast<std::size_t>(slab.count() * components) * sizeof(V));
  TETWARP_CUDA_TRY(cudaMemcpy(staging_.data(), device, staging_.size(), cudaMemcpyDeviceToHost));
  const V* from = reinterpret_cast<const V*>(staging_.data());
  for (std::int64_t z = 0; z < slab.size.z; ++z) {
    for (std::int64_t y = 0; y < slab.size.y; ++y, from += row) {
      const std::size_t to =
          buffer_index(view, slab.begin + glm::i64vec3(0, y, z)) * static_cast<std::size_t>(components);
      std::copy_n(from, row, reinterpret_cast<V*>(view.voxels) + to);
    }
  }
}

void SlabWriter::finish() {
  for (const auto& on_device : targets_) {
    const std::span<SliceRange> ranges = on_device->target.sampled_slices;
    if (ranges.empty()) continue;
    std::vector<long long> first(ranges.size()), last(ranges.size());
    on_device->first.download(first.data(), first.size());
    on_device->last.download(last.data(), last.size());
    for (std::size_t k = 0; k < ranges.size(); ++k) ranges[k] = {first[k], last[k]};
  }
}

}  // namespace tetwarp::cuda_detail
