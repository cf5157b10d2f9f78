#include <algorithm>
#include <cmath>
#include <cstring>

#include "cuda/pointer_check.h"
#include "cuda/slab.h"
#include "deform/core/visit_cell.h"
#include "deform/field_check.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace cuda_detail {

namespace {

constexpr unsigned long long kNobody = ~0ULL;

/// A field on the device: its vertices, snapped.
struct DeviceField {
  LatticeFrame frame;
  const Vertex* vertices;

  __device__ glm::i64vec3 cell_at(std::int64_t number) const {
    return {number % frame.cells.x, number / frame.cells.x % frame.cells.y, number / (frame.cells.x * frame.cells.y)};
  }
  __device__ Cell cell(const glm::i64vec3& at) const {
    const std::int64_t row = frame.cells.x + 1, slice = row * (frame.cells.y + 1);
    const Vertex* first = vertices + at.z * slice + at.y * row + at.x;
    return {{first[0], first[1], first[row], first[row + 1], first[slice], first[slice + 1], first[slice + row],
             first[slice + row + 1]}};
  }
  __device__ static bool is_odd(const glm::i64vec3& at) { return ((at.x + at.y + at.z) & 1) != 0; }
  __host__ __device__ std::int64_t cell_count() const { return frame.cells.x * frame.cells.y * frame.cells.z; }
};

/// Doubles as integers of the same order, so that integer atomics find the smallest and largest.
__host__ __device__ inline unsigned long long ordered(double value) {
  unsigned long long bits;
  memcpy(&bits, &value, sizeof bits);
  return bits >> 63 ? ~bits : bits | (1ULL << 63);
}
inline double from_ordered(unsigned long long key) {
  const unsigned long long bits = key >> 63 ? key & ~(1ULL << 63) : ~key;
  double value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

struct Statistics {
  unsigned long long inverted, degenerate, jacobian_min, jacobian_max, bad_vertex;
};

__global__ void snap_kernel(LatticeFrame frame, const glm::vec3* displacement, std::int64_t vertices, Vertex* out,
                            Statistics* statistics) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= vertices) return;
  const glm::i64vec3 size = frame.cells + std::int64_t{1};
  const glm::i64vec3 at(n % size.x, n / size.x % size.y, n / (size.x * size.y));
  Vertex vertex;
  if (!frame.snap_vertex(at, displacement[n], vertex))
    atomicMin(&statistics->bad_vertex, static_cast<unsigned long long>(n));
  out[n] = vertex;
}

__global__ void statistics_kernel(DeviceField field, Statistics* statistics) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= field.cell_count()) return;
  const glm::i64vec3 at = field.cell_at(n);
  const Cell cell = field.cell(at);
  double determinants[kTetrahedraPerCell];
  if (DeviceField::is_odd(at)) {
    cell_jacobians<Wide, true>(cell, determinants);
  } else {
    cell_jacobians<Wide, false>(cell, determinants);
  }
  for (const double determinant : determinants) {
    if (determinant < 0) atomicAdd(&statistics->inverted, 1ULL);
    if (determinant == 0) atomicAdd(&statistics->degenerate, 1ULL);
    const unsigned long long key = ordered(determinant);
    if (key < statistics->jacobian_min) atomicMin(&statistics->jacobian_min, key);
    if (key > statistics->jacobian_max) atomicMax(&statistics->jacobian_max, key);
  }
}

/// Every cell claims its voxels of the slab; the lowest number wins, whatever the order.
__global__ void claim_kernel(DeviceField field, SlabBox slab, unsigned long long* owner, unsigned* owners) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= field.cell_count()) return;
  const glm::i64vec3 at = field.cell_at(n);
  const VoxelBox region{slab.begin, slab.begin + slab.size};
  visit_cell(field.cell(at), DeviceField::is_odd(at), region, field.frame.nudge,
             [&](const glm::i64vec3& voxel, const glm::i32vec3&, int t, const Tetrahedron&) {
               const std::int64_t place = slab.offset(voxel);
               atomicMin(&owner[place],
                         static_cast<unsigned long long>(n) * kTetrahedraPerCell + static_cast<unsigned>(t));
               if (owners) atomicAdd(&owners[place], 1u);
             });
}

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
    const glm::i64vec3 at = field.cell_at(static_cast<std::int64_t>(owner[n] / kTetrahedraPerCell));
    const Tetrahedron t =
        tetrahedron_of(field.cell(at), static_cast<int>(owner[n] % kTetrahedraPerCell), DeviceField::is_odd(at));
    out.offset[n] = interpolate_u(t, detail::to_steps(voxel), field.frame.nudge.signs(voxel));
    if (out.jacobian) out.jacobian[n] = static_cast<float>(jacobian(t));
    if (outside) atomicAdd(&counts->conflicts, 1ULL);
  }
  if (out.owners) {
    out.owners[n] = static_cast<std::uint16_t>(owners[n] < 65535u ? owners[n] : 65535u);
    if (owners[n] > 1) atomicAdd(&counts->multiply_owned, 1ULL);
  }
}

/// Box of the rest places of all cells that may reach a region: low and high, 2^-12 voxel.
__global__ void reach_kernel(DeviceField field, VoxelBox region, int* low_high) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= field.cell_count()) return;
  const Cell cell = field.cell(field.cell_at(n));
  if (detail::is_empty(detail::candidates(field.frame.nudge, box_of(cell), region))) return;
  for (const Vertex& vertex : cell.corner) {
    const glm::i32vec3 rest = vertex.deformed + vertex.u;
    for (int axis = 0; axis < 3; ++axis) {
      if (rest[axis] < low_high[axis]) atomicMin(&low_high[axis], rest[axis]);
      if (rest[axis] > low_high[3 + axis]) atomicMax(&low_high[3 + axis], rest[axis]);
    }
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

glm::i64vec3 unravel(unsigned long long number, const glm::i64vec3& size) {
  const auto n = static_cast<std::int64_t>(number);
  return {n % size.x, n / size.x % size.y, n / (size.x * size.y)};
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
    const glm::i64vec3 size = region.end - region.begin;
    const std::int64_t rows = std::clamp<std::int64_t>(kSlabVoxels / size.x, 1, size.y);
    const std::int64_t slices =
        rows < size.y ? 1 : std::clamp<std::int64_t>(kSlabVoxels / (size.x * size.y), 1, size.z);
    for (std::int64_t z = 0; z < size.z; z += slices) {
      for (std::int64_t y = 0; y < size.y; y += rows) {
        const SlabBox slab{region.begin + glm::i64vec3(0, y, z),
                           {size.x, std::min(rows, size.y - y), std::min(slices, size.z - z)}};
        map_slab(slab, writer);
        writer.write(slab, mapped_, counts_.data());
        if (control.progress) {
          control.progress(static_cast<double>(z * size.y + y * slab.size.z + slab.size.y * slab.size.z) /
                           static_cast<double>(size.y * size.z));
        }
        if (control.stop.stop_requested()) throw Cancelled();
      }
    }
    writer.finish();
    Counts counts;
    counts_.download(&counts, 1, stream_);  // waits for all that was queued
    return report_of(counts, maps);
  }

 protected:
  virtual Region source_extent(const Geometry& source, const Region& region) const = 0;
  virtual void check_wanted(const Maps&) const {}
  virtual void map_slab(const SlabBox& slab, const SlabWriter& writer) = 0;
  virtual void describe_field(Report&) const {}

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

 private:
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
    field_.frame = make_lattice_frame(output(), field);
    rest_outside_ = field.outside == Outside::rest;
    if (control.stop.stop_requested()) throw Cancelled();
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    const glm::i64vec3 size = field.lattice->size;
    const std::int64_t vertices = size.x * size.y * size.z;
    const glm::vec3* displacement = on_device(field.displacement, field.memory, vertices);
    field_.vertices = vertices_.reserve(static_cast<std::size_t>(vertices));
    statistics_ = {0, 0, ~0ULL, 0, ~0ULL};
    found_.upload(&statistics_, 1, stream_);
    snap_kernel<<<blocks_for(vertices), kThreads, 0, stream_>>>(field_.frame, displacement, vertices, vertices_.data(),
                                                                found_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    found_.download(&statistics_, 1, stream_);
    if (statistics_.bad_vertex != ~0ULL) refuse_vertex(unravel(statistics_.bad_vertex, size));
    statistics_kernel<<<blocks_for(field_.cell_count()), kThreads, 0, stream_>>>(field_, found_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    found_.download(&statistics_, 1, stream_);
    ready_ = true;
  }

 private:
  Region source_extent(const Geometry& source, const Region& region) const override {
    const DeviceScope scope(device_);
    int low_high[6] = {INT32_MAX, INT32_MAX, INT32_MAX, INT32_MIN, INT32_MIN, INT32_MIN};
    DeviceBuffer<int> found;
    found.upload(low_high, 6, stream_);
    reach_kernel<<<blocks_for(field_.cell_count()), kThreads, 0, stream_>>>(field_, {region.begin, region.end},
                                                                            found.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    found.download(low_high, 6, stream_);
    glm::dvec3 low(region.begin), high(region.end - std::int64_t{1});  // Outside::rest: voxels that stay where they are
    for (int axis = 0; axis < 3; ++axis) {
      const double least = low_high[axis] * (1.0 / kStepsPerVoxel) - field_.frame.beyond_rest()[axis];
      const double most = low_high[3 + axis] * (1.0 / kStepsPerVoxel) + field_.frame.beyond_rest()[axis];
      low[axis] = rest_outside_ ? std::min(low[axis], least) : least;
      high[axis] = rest_outside_ ? std::max(high[axis], most) : most;
    }
    if (!rest_outside_ && low_high[0] > low_high[3]) return {};
    return source_box(source, output(), low, high);
  }

  void map_slab(const SlabBox& slab, const SlabWriter& writer) override {
    const auto voxels = static_cast<std::size_t>(slab.count());
    owner_.fill(0xFF, voxels, stream_);
    if (writer.wants_owners()) owners_.fill(0, voxels, stream_);
    unsigned* owners = writer.wants_owners() ? owners_.data() : nullptr;
    claim_kernel<<<blocks_for(field_.cell_count()), kThreads, 0, stream_>>>(field_, slab, owner_.data(), owners);
    TETWARP_CUDA_TRY(cudaGetLastError());
    const Settled settled{mapped_.mapped.reserve(voxels), mapped_.offset.reserve(voxels),
                          writer.wants_jacobian() ? mapped_.jacobian.reserve(voxels) : nullptr,
                          writer.wants_owners() ? mapped_.owners.reserve(voxels) : nullptr};
    settle_kernel<<<blocks_for(slab.count()), kThreads, 0, stream_>>>(field_, rest_outside_, slab, owner_.data(),
                                                                      owners, settled, counts_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }

  void describe_field(Report& report) const override {
    report.inverted = statistics_.inverted;
    report.degenerate = statistics_.degenerate;
    report.jacobian_min = from_ordered(statistics_.jacobian_min);
    report.jacobian_max = from_ordered(statistics_.jacobian_max);
  }

  DeviceField field_;
  bool rest_outside_ = false;
  Statistics statistics_{};
  DeviceBuffer<Vertex> vertices_;
  DeviceBuffer<Statistics> found_;
  DeviceBuffer<unsigned long long> owner_;
  DeviceBuffer<unsigned> owners_;
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
    if (bad != ~0ULL) refuse_sample(unravel(bad, frame_.size));
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
