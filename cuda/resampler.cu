#include <algorithm>
#include <cmath>

#include "cuda/gather.h"
#include "cuda/pointer_check.h"
#include "deform/core/visit_cell.h"
#include "deform/field_check.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace cuda_detail {

namespace {

constexpr std::int64_t kPlainVoxels = std::int64_t{1} << 30;  ///< at a time, where nothing is kept of each

struct Settled {
  std::uint8_t* mapped;
  glm::vec3* offset;
  float* jacobian;        ///< or null
  std::uint16_t* owners;  ///< or null
};

/// From the owner of each voxel to where it comes from; voxels outside the undeformed lattice may stay where they are.
__global__ void settle_kernel(DeviceField field, bool rest_outside, SlabBox slab, const unsigned long long* owner,
                              const unsigned* owners, Settled out, Counts* counts) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= slab.count()) return;
  const glm::i64vec3 voxel = slab.voxel(n);
  const bool owned = owner[n] != kNobody;
  const bool outside = rest_outside && !field.frame.holds(voxel);
  out.mapped[n] = owned || outside;
  out.offset[n] = glm::vec3(0);
  if (out.jacobian) out.jacobian[n] = owned || !outside ? __int_as_float(0x7fc00000) : 1.0f;
  if (owned) {
    const Tetrahedron t = tetrahedron_numbered(field, owner[n]);
    out.offset[n] = interpolate_u(t, detail::to_steps(voxel), field.frame.nudge.signs(voxel));
    if (out.jacobian) out.jacobian[n] = static_cast<float>(jacobian(t));
    if (outside) atomicAdd(&counts->conflicts, 1ULL);
  }
  if (out.owners) {
    out.owners[n] = static_cast<std::uint16_t>(owners[n] < 65535u ? owners[n] : 65535u);
    if (owners[n] > 1) atomicAdd(&counts->multiply_owned, 1ULL);
  }
}

__global__ void pull_kernel(PullFrame frame, SlabBox slab, std::uint8_t* mapped, glm::vec3* offset) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n < slab.count()) mapped[n] = frame.offset_at(slab.voxel(n), offset[n]);
}

__global__ void check_pull_kernel(PullFrame frame, std::int64_t samples, unsigned long long* bad) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= samples || LatticeFrame::is_usable(frame.in_voxels(frame.displacement[n]), kLargestIndex)) return;
  atomicMin(bad, static_cast<unsigned long long>(n));
}

/// What forward and pull have in common: slabs of voxels, of which `map_slab` says where they come from.
class CudaResampler : public Resampler {
 public:
  CudaResampler(Geometry output, int device) : Resampler(output), device_(device) {
    int count = 0;
    TETWARP_CUDA_TRY(cudaGetDeviceCount(&count));
    if (device < 0 || device >= count) {
      throw DeviceError("no CUDA device " + std::to_string(device) + ", " + std::to_string(count) +
                        " found; see tetwarp --version");
    }
  }

  Region source_region(const Geometry& source, Region region) const override {
    require(ready_, "source_region needs a field: call set_field first");
    region = intersection(region, whole(output()));
    return tetwarp::is_empty(region) ? Region{} : source_extent(source, region);
  }

  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control) override {
    require(ready_, "resample needs a field: call set_field first");
    check_targets(*this, targets, region);
    check_maps(maps, output(), region);
    check_wanted(maps);
    if (tetwarp::is_empty(region)) return report_of({}, maps);
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    if (control.stop.stop_requested()) throw Cancelled();
    SlabWriter writer(output(), targets, maps, stream_);
    counts_.fill(0, 1, stream_);
    plainly_covered_ = 0;
    const bool plain = can_write_plainly() && writer.is_plain();
    for_each_slab(region, plain && targets[0].output.memory == Memory::device ? kPlainVoxels : kSlabVoxels, control,
                  [&](const SlabBox& slab) {
                    if (plain) return write_plainly(slab, writer);
                    map_slab(slab, writer);
                    writer.write(slab, mapped_, counts_.data());
                  });
    writer.finish();
    Counts counts;
    counts_.download(&counts, 1, stream_);  // waits for all that was queued
    if (plain) {
      counts.covered = plainly_covered_;
      counts.uncovered = static_cast<unsigned long long>(voxel_count(region)) - plainly_covered_;
    }
    return report_of(counts, maps);
  }

 protected:
  virtual Region source_extent(const Geometry& source, const Region& region) const = 0;
  virtual void check_wanted(const Maps&) const {}
  virtual void map_slab(const SlabBox& slab, const SlabWriter& writer) = 0;
  virtual void describe_field(Report&) const {}
  /// Whether voxels can be found and sampled in one go, and how.
  virtual bool can_write_plainly() const { return false; }
  virtual void write_plainly(const SlabBox&, SlabWriter&) {}

  /// The displacements on the device: uploaded, or where they are already.
  const glm::vec3* on_device(const glm::vec3* displacement, Memory memory, std::int64_t vectors) {
    require_memory(displacement, memory, "the field");
    if (memory == Memory::device) return displacement;
    displacement_.upload(displacement, static_cast<std::size_t>(vectors), stream_);
    return displacement_.data();
  }

  int device_;
  bool ready_ = false;
  cudaStream_t stream_ = nullptr;  ///< of the latest call
  Mapped mapped_;
  DeviceBuffer<Counts> counts_;
  DeviceBuffer<glm::vec3> displacement_;
  std::uint64_t plainly_covered_ = 0;

 private:
  /// Whole slices or, where one is too large, whole rows of them; asks for cancellation between slabs.
  template <class Work>
  static void for_each_slab(const Region& region, std::int64_t voxels, const Control& control, Work&& work) {
    const glm::i64vec3 size = region.end - region.begin;
    const std::int64_t rows = std::clamp<std::int64_t>(voxels / size.x, 1, size.y);
    const std::int64_t slices = rows < size.y ? 1 : std::clamp<std::int64_t>(voxels / (size.x * size.y), 1, size.z);
    for (std::int64_t z = 0; z < size.z; z += slices) {
      for (std::int64_t y = 0; y < size.y; y += rows) {
        const SlabBox slab{region.begin + glm::i64vec3(0, y, z),
                           {size.x, std::min(rows, size.y - y), std::min(slices, size.z - z)}};
        work(slab);
        if (control.progress) {
          control.progress(static_cast<double>(z * size.y + y * slab.size.z + slab.size.y * slab.size.z) /
                           static_cast<double>(size.y * size.z));
        }
        if (control.stop.stop_requested()) throw Cancelled();
      }
    }
  }

  Report report_of(const Counts& counts, const Maps& maps) const {
    Report report;
    report.covered = counts.covered;
    report.uncovered = counts.uncovered;
    report.clamped = counts.clamped;
    report.padded = counts.padded;
    report.conflicts = counts.conflicts;
    if (maps.owners.voxels) report.multiply_owned = counts.multiply_owned;
    describe_field(report);
    return report;
  }
};

class ForwardResampler final : public CudaResampler {
 public:
  using CudaResampler::CudaResampler;
  using Resampler::set_field;

  void set_field(const FieldView& field, const Control& control) override {
    ready_ = false;
    const LatticeFrame frame = make_lattice_frame(output(), field);
    rest_outside_ = field.outside == Outside::rest;
    if (control.stop.stop_requested()) throw Cancelled();
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    const glm::i64vec3 size = field.lattice->size;
    gather_.forget_field();
    claims_.forget_field();
    if (field.memory == Memory::device) {
      require_memory(field.displacement, field.memory, "the field");
      lattice_.set(frame, output(), field.displacement, nullptr, control.jacobian_range, stream_);
    } else {
      on_device(field.displacement, field.memory, size.x * size.y * size.z);
      lattice_.set(frame, output(), displacement_.data(), displacement_.data(), control.jacobian_range, stream_);
    }
    ready_ = true;
  }

 private:
  Region source_extent(const Geometry& source, const Region& region) const override {
    const DeviceScope scope(device_);
    int low_high[6];
    lattice_.reach(region.begin, region.end, low_high, nullptr);  // the stream of set_field may be gone
    const glm::dvec3 beyond = lattice_.field().frame.beyond_rest();
    glm::dvec3 low(region.begin), high(region.end - std::int64_t{1});  // Outside::rest: voxels that stay where they are
    for (int axis = 0; axis < 3; ++axis) {
      const double least = low_high[axis] * (1.0 / kStepsPerVoxel) - beyond[axis];
      const double most = low_high[3 + axis] * (1.0 / kStepsPerVoxel) + beyond[axis];
      low[axis] = rest_outside_ ? std::min(low[axis], least) : least;
      high[axis] = rest_outside_ ? std::max(high[axis], most) : most;
    }
    if (!rest_outside_ && low_high[0] > low_high[3]) return {};
    return source_box(source, output(), low, high);
  }

  bool can_gather() const { return lattice_.field().has_steps() && !rest_outside_; }
  bool can_write_plainly() const override { return can_gather(); }

  void write_plainly(const SlabBox& slab, SlabWriter& writer) override {
    std::visit([&](const auto& sink) { plainly_covered_ += gather_.run(lattice_, slab, sink, stream_).covered; },
               writer.plain_sink(slab));
    writer.finish_plain(slab);
  }

  void map_slab(const SlabBox& slab, const SlabWriter& writer) override {
    const auto voxels = static_cast<std::size_t>(slab.count());
    const Settled settled{mapped_.mapped.reserve(voxels), mapped_.offset.reserve(voxels),
                          writer.wants_jacobian() ? mapped_.jacobian.reserve(voxels) : nullptr,
                          writer.wants_owners() ? mapped_.owners.reserve(voxels) : nullptr};
    if (can_gather() && !settled.jacobian && !settled.owners) {
      gather_.run(lattice_, slab, OffsetSink{slab, settled.mapped, settled.offset}, stream_);
      return;
    }
    const DeviceField& field = lattice_.field();
    claims_.claim(field, slab, writer.wants_owners(), stream_);
    settle_kernel<<<blocks_for(slab.count()), kThreads, 0, stream_>>>(
        field, rest_outside_, slab, claims_.owner(), writer.wants_owners() ? claims_.owners() : nullptr, settled,
        counts_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  void describe_field(Report& report) const override {
    const FieldStatistics& found = lattice_.statistics();
    report.inverted = found.inverted;
    report.degenerate = found.degenerate;
    report.jacobian_min = found.jacobian_min;
    report.jacobian_max = found.jacobian_max;
  }

  LatticeOnDevice lattice_;
  Gather gather_;
  Claims claims_;
  bool rest_outside_ = false;
};

class PullResampler final : public CudaResampler {
 public:
  using CudaResampler::CudaResampler;
  using Resampler::set_field;

  void set_field(const PullFieldView& field, const Control& control) override {
    ready_ = false;
    frame_ = make_pull_frame(output(), field);
    grid_ = *field.grid;
    given_ = field.displacement;
    given_in_ = field.memory;
    if (control.stop.stop_requested()) throw Cancelled();
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    const std::int64_t samples = frame_.size.x * frame_.size.y * frame_.size.z;
    frame_.displacement = on_device(field.displacement, field.memory, samples);
    bad_.fill(0xFF, 1, stream_);
    check_pull_kernel<<<blocks_for(samples), kThreads, 0, stream_>>>(frame_, samples, bad_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    unsigned long long bad = 0;
    bad_.download(&bad, 1, stream_);
    if (bad != ~0ULL) refuse_sample(unravel(static_cast<std::int64_t>(bad), frame_.size));
    ready_ = true;
  }

 private:
  Region source_extent(const Geometry& source, const Region& region) const override {
    PullFrame frame = frame_;
    std::vector<glm::vec3> samples;
    frame.displacement = given_;
    if (given_in_ == Memory::device) {
      samples.resize(static_cast<std::size_t>(voxel_count(grid_)));
      const DeviceScope scope(device_);
      TETWARP_CUDA_TRY(cudaMemcpy(samples.data(), given_, samples.size() * sizeof(glm::vec3), cudaMemcpyDeviceToHost));
      frame.displacement = samples.data();
    }
    return pull_source_region(frame, grid_, output(), source, region);
  }

  void check_wanted(const Maps& maps) const override {
    require(!maps.jacobian.voxels && !maps.owners.voxels, "a pull field has no tetrahedra: no Jacobian or owners map");
  }

  void map_slab(const SlabBox& slab, const SlabWriter&) override {
    const auto voxels = static_cast<std::size_t>(slab.count());
    pull_kernel<<<blocks_for(slab.count()), kThreads, 0, stream_>>>(frame_, slab, mapped_.mapped.reserve(voxels),
                                                                    mapped_.offset.reserve(voxels));
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  PullFrame frame_;
  Geometry grid_;
  const glm::vec3* given_ = nullptr;  ///< the samples where the caller has them
  Memory given_in_ = Memory::host;
  DeviceBuffer<unsigned long long> bad_;
};

}  // namespace

}  // namespace cuda_detail

std::unique_ptr<Resampler> make_cuda_resampler(Geometry output, int device, Limits) {
  return std::make_unique<cuda_detail::ForwardResampler>(output, device);
}

std::unique_ptr<Resampler> make_cuda_pull_resampler(Geometry output, int device, Limits) {
  return std::make_unique<cuda_detail::PullResampler>(output, device);
}

}  // namespace tetwarp
