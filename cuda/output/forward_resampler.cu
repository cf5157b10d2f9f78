// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/output/cuda_resampler.h"

#include <algorithm>
#include <glm/common.hpp>
#include <optional>
#include <vector>

#include "cuda/factories.h"
#include "cuda/lattice/lattice_part.h"
#include "cuda/output/mesh_resampler.h"
#include "cuda/owners/gather.cuh"
#include "cuda/runtime/pointer_check.h"
#include "cuda/runtime/warp.cuh"
#include "deform/core/visit_cell.h"
#include "deform/field_check.h"
#include "deform/lattice_or_mesh.h"
#include "deform/target_check.h"
#include "deform/update/updated_target.h"

namespace tetwarp {

namespace cuda_detail {

namespace {

/// Device memory of a vertex from the host: its displacement, in place of which it is packed, and some bits; or a
/// Vertex as well.
constexpr std::uint64_t kStepVertexBytes = sizeof(glm::vec3) + 1, kVertexBytes = kStepVertexBytes + sizeof(Vertex);

/// What is written of each voxel of a box, in the order of the voxels.
struct VoxelMapping {
  MappedVoxels places;
  float* jacobian;            ///< determinant of its owner, NaN where nobody owns it; or null
  std::uint16_t* owners;      ///< number of owners, at most 65535; or null
  std::uint32_t* tetrahedra;  ///< number of its owner in the whole lattice, or kNoTetrahedron; or null
};

/// From the owner of each voxel to where it comes from; voxels outside the undeformed lattice may stay where they are.
/// A thread a voxel.
///
/// @param whole         the frame of the whole lattice, of which `field` may be a part
/// @param rest_outside  whether voxels outside the whole undeformed lattice stay
/// @param owner         lowest number of an owner of each voxel of the box, or kNobody: from `Claims`
/// @param owners        number of owners of each voxel, where `out.owners` is wanted; else null
/// @param out           written, a value for each voxel of the box
/// @param counts        conflicts and voxels with several owners are added
__global__ void map_voxels_kernel(DeviceField field, LatticeFrame whole, bool rest_outside, SlabBox box,
                                  const unsigned long long* owner, const unsigned* owners, VoxelMapping out,
                                  Counts* counts) {
  const std::int64_t n = thread_of_grid();
  if (n >= box.count()) return;
  const glm::i64vec3 voxel = box.voxel(n);
  const bool owned = owner[n] != kNobody;
  const bool outside = rest_outside && !whole.holds(voxel);
  out.places.mapped[n] = owned || outside;
  out.places.put_nothing(n);
  if (out.jacobian) out.jacobian[n] = owned || !outside ? __int_as_float(0x7fc00000) : 1.0f;
  if (out.tetrahedra) {
    const glm::i64vec3& cells = whole.cells;
    const std::int64_t before = field.frame.first_slice * cells.y * cells.x;  // cells of the parts before
    out.tetrahedra[n] =
        owned ? static_cast<std::uint32_t>(owner[n] + TetrahedronNumber::of(before, 0)) : kNoTetrahedron;
  }
  if (owned) {
    const Tetrahedron t = tetrahedron_numbered(field, owner[n]);
    out.places.put(n, t, voxel, field.frame.nudge.signs(voxel));
    if (out.jacobian) out.jacobian[n] = forward_jacobian(t);
    if (outside) atomicAdd(&counts->conflicts, 1ULL);
  }
  if (out.owners) {
    out.owners[n] = static_cast<std::uint16_t>(owners[n] < 65535u ? owners[n] : 65535u);
    if (owners[n] > 1) atomicAdd(&counts->multiply_owned, 1ULL);
  }
}

/// Whether each voxel has an owner. A thread a voxel.
__global__ void mapped_of_owners_kernel(const std::uint32_t* tetrahedra, std::int64_t count, std::uint8_t* mapped) {
  const std::int64_t n = thread_of_grid();
  if (n < count) mapped[n] = tetrahedra[n] != kNoTetrahedron;
}

constexpr int kReachedAtOnce = 1024;  ///< vertices of a slice that a thread block looks at

/// How far the vertices of each slice reach along k of the output; some thread blocks a slice.
///
/// @param blocks_per_slice  each of which looks at kReachedAtOnce vertices, the last at what is left
/// @param reach             one for each slice of vertices, 2^-12 voxel: widened once a warp, by atomics
__global__ void reach_kernel(DeviceField field, unsigned blocks_per_slice, SliceReach* reach) {
  const std::int64_t slice = blockIdx.x / blocks_per_slice, row = field.frame.cells.x + 1,
                     end = row * (field.frame.cells.y + 1);
  const std::int64_t first = std::int64_t{blockIdx.x % blocks_per_slice} * kReachedAtOnce;
  int low = INT32_MAX, high = INT32_MIN;
  for (std::int64_t n = first + threadIdx.x; n < min(first + kReachedAtOnce, end); n += kThreads) {
    const int z = field.vertex({n % row, n / row, slice}).deformed.z;
    low = min(low, z);
    high = max(high, z);
  }
  low = warp_min(low);
  high = warp_max(high);
  if (lane_of_warp() != 0) return;
  atomicMin(&reach[slice].low, low);
  atomicMax(&reach[slice].high, high);
}

class LatticeResampler final : public CudaResampler<ForwardResampler> {
 public:
  using CudaResampler::CudaResampler;

  void set_field(const FieldView& field, const FieldOptions& options, const Control& control) override {
    ready_ = streamed_ = false;
    frame_ = make_lattice_frame(output(), field);
    field_ = field;
    rest_outside_ = field.outside == Outside::rest;
    wants_range_ = options.jacobian_range;
    if (control.stop.stop_requested()) throw Cancelled();
    const DeviceScope scope(device_);
    stream_ = static_cast<cudaStream_t>(control.stream);
    require_memory(field.displacement, field.memory, "the field");
    reach_.clear();
    vertex_bytes_ = make_step_lattice(frame_, output()).cells.x != 0 ? kStepVertexBytes : kVertexBytes;
    if (field.memory == Memory::device) {
      held_ = {};
      set_lattice(frame_, field.displacement, nullptr);
      statistics_ = lattice_->statistics();
    } else if (!hold_all()) {
      scan_in_pieces(control);
    }
    ready_ = true;
  }

  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
                  const PartSink& finished) override {
    updated_.clear();
    reuse_ = Reuse::nothing;
    seen_.reset();
    if (ready_)
      require_numbers(
          maps, static_cast<std::uint64_t>(kTetrahedraPerCell * frame_.cells.x * frame_.cells.y * frame_.cells.z));
    return CudaResampler::resample(region, targets, maps, control, finished);
  }

  Update update(std::span<const Target> targets, const Control& control, std::span<const ValueRange> seen) override {
    std::vector<UpdatedTarget> given(targets.begin(), targets.end());
    const bool stays_here = std::all_of(targets.begin(), targets.end(), [](const Target& target) {
      return target.output.memory == Memory::device;  // others are computed in a buffer of the resampler
    });
    const bool may_keep = ready_ && can_write_plainly() && stays_here;
    reuse_ = !may_keep ? Reuse::nothing : given == updated_ ? Reuse::now : Reuse::later;
    seen_.reset();
    if (may_keep && !seen.empty() && targets.size() == 1 && is_on_grid_here(targets[0].source))
      seen_ = {targets[0].source, targets[0].background, seen};
    updated_.clear();
    changed_ = {whole(output())};
    const Report report = CudaResampler::resample(whole(output()), targets, {}, control, {});
    if (may_keep) updated_ = std::move(given);
    return {report, std::move(changed_)};
  }

 private:
  /// Whether a source lies whole on the device, on the grid of the output.
  bool is_on_grid_here(const ConstVolumeView& source) const {
    return source.memory == Memory::device && *source.geometry == output() && source.buffered == whole(output());
  }
  Slices all_cells() const { return {0, frame_.cells.z}; }
  std::uint64_t slice_vertices() const {
    return static_cast<std::uint64_t>((frame_.cells.x + 1) * (frame_.cells.y + 1));
  }
  /// Device memory of some slices of cells.
  std::uint64_t bytes_of(const Slices& cells) const {
    return static_cast<std::uint64_t>(cells.end - cells.begin + 1) * slice_vertices() * vertex_bytes_;
  }

  void set_lattice(const LatticeFrame& frame, const glm::vec3* displacement, std::uint64_t* room) {
    gather_.forget_field();
    claims_.forget_field();
    lattice_->set(frame, output(), displacement, room, wants_range_, stream_);
    if (!lattice_->field().has_steps()) vertex_bytes_ = kVertexBytes;
  }

  /// Uploads a part of the lattice.
  void hold_cells(const Slices& cells) {
    held_ = {};
    const std::size_t slice = slice_vertices(),
                      vertices = slice * static_cast<std::size_t>(cells.end - cells.begin + 1);
    glm::vec3* here = displacement_.reserve(vertices);
    const glm::vec3* from = field_.displacement + slice * static_cast<std::size_t>(cells.begin);
    uploads_->copy(reinterpret_cast<std::byte*>(here), reinterpret_cast<const std::byte*>(from),
                   vertices * sizeof(glm::vec3), stream_);
    set_lattice(part_of(frame_, cells), here, reinterpret_cast<std::uint64_t*>(here));
    held_ = cells;
  }

  /// @return whether the whole field fits
  bool hold_all() {
    const auto fits = [&] { return bytes_of(all_cells()) <= most_bytes_ && may_hold(bytes_of(all_cells())); };
    if (!fits()) return false;
    make_room_for_field(bytes_of(all_cells()));
    hold_cells(all_cells());
    statistics_ = lattice_->statistics();
    return fits();  // vertices that do not rest at whole steps take more than was known
  }

  /// One pass over a field that does not fit: its statistics, and which part of the output each slice reaches.
  void scan_in_pieces(const Control& control) {
    streamed_ = true;
    for (bool done = false; !done;) {
      const std::uint64_t allowed = allowed_bytes();
      const std::uint64_t slice_bytes = slice_vertices() * vertex_bytes_;
      const std::int64_t cells = cells_of_piece(frame_.cells.z, slice_bytes, held_field_bytes(), allowed);
      make_room_for_field(bytes_of({0, cells}));
      done = scan(cells, control);
    }
  }

  /// @return false where vertices take more memory than was known
  bool scan(std::int64_t cells_of_piece, const Control& control) {
    const std::uint64_t vertex_bytes = vertex_bytes_;
    statistics_ = {};
    reach_.assign(static_cast<std::size_t>(frame_.cells.z + 1), {});
    for (std::int64_t begin = 0; begin < frame_.cells.z; begin += cells_of_piece) {
      if (control.stop.stop_requested()) throw Cancelled();
      const Slices cells{begin, std::min(begin + cells_of_piece, frame_.cells.z)};
      hold_cells(cells);
      if (vertex_bytes_ != vertex_bytes) return false;
      const FieldStatistics& found = lattice_->statistics();
      statistics_.inverted += found.inverted;
      statistics_.degenerate += found.degenerate;
      statistics_.jacobian_min = std::min(statistics_.jacobian_min, found.jacobian_min);
      statistics_.jacobian_max = std::max(statistics_.jacobian_max, found.jacobian_max);
      find_reach(cells);
    }
    return true;
  }

  /// Of the slices of vertices of the lattice that is held.
  void find_reach(const Slices& cells) {
    const std::span<SliceReach> slices = std::span(reach_).subspan(
        static_cast<std::size_t>(cells.begin), static_cast<std::size_t>(cells.end - cells.begin + 1));
    const std::vector<SliceReach> nothing(slices.size());
    reach_on_device_.upload(nothing.data(), nothing.size(), stream_);
    const auto blocks_per_slice = static_cast<unsigned>((slice_vertices() + kReachedAtOnce - 1) / kReachedAtOnce);
    reach_kernel<<<static_cast<unsigned>(slices.size()) * blocks_per_slice, kThreads, 0, stream_>>>(
        lattice_->field(), blocks_per_slice, reach_on_device_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    reach_on_device_.download(slices.data(), slices.size(), stream_);
  }

  Slices cells_for(const Slices& slices) const {
    const Slices cells = cells_reaching(reach_, slices.begin, slices.end);
    return cells.is_empty() ? Slices{0, std::min<std::int64_t>(2, frame_.cells.z)} : cells;
  }

  std::uint64_t field_bytes(const Slices& slices) const override {
    if (field_.memory == Memory::device) return 0;
    return streamed_ ? bytes_of(cells_for(slices)) : held_field_bytes();
  }
  std::uint64_t held_field_bytes() const override { return displacement_.capacity() * vertex_bytes_; }
  const char* held_of_field() const override { return streamed_ ? "part of the field" : "whole field"; }
  bool is_field_streamed() const override { return streamed_; }
  void hold_field(const Slices& slices) override {
    if (!streamed_) return;
    const Slices cells = cells_for(slices);
    if (cells != held_) hold_cells(cells);
  }
  bool stream_field(const Control& control) override {
    if (streamed_ || field_.memory == Memory::device) return false;
    most_bytes_ = bytes_of(all_cells()) - 1;  // so that the next one is streamed at once
    ready_ = false;                           // unless the scan is whole
    scan_in_pieces(control);
    ready_ = true;
    return true;
  }
  void release_field() override {
    if (!streamed_ && field_.memory == Memory::host) return;
    displacement_.release();
    if (streamed_) lattice_.emplace();
    held_ = {};
  }
  void prepare_slabs() override {
    if (!reach_.empty()) return;
    reach_.resize(static_cast<std::size_t>(frame_.cells.z + 1));
    try {
      find_reach(all_cells());
    } catch (...) {
      reach_.clear();
      throw;
    }
  }

  Region slab_source(const Geometry& source, const Region& slab) const override {
    const Slices cells = cells_reaching(reach_, slab.begin.z, slab.end.z);
    RestBox box{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
    if (!cells.is_empty()) box = rest_box(frame_, cells);
    return source_of(source, slab, box);
  }

  Region source_extent(const Geometry& source, const Region& region) const override {
    if (streamed_) return slab_source(source, region);
    const DeviceScope scope(device_);
    int low_high[6];
    lattice_->reach(region.begin, region.end, low_high, nullptr);  // the stream of set_field may be gone
    RestBox box{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
    if (low_high[0] <= low_high[3]) {
      const glm::dvec3 beyond = frame_.beyond_rest();
      for (int axis = 0; axis < 3; ++axis) {
        box.low[axis] = low_high[axis] * (1.0 / kStepsPerVoxel) - beyond[axis];
        box.high[axis] = low_high[3 + axis] * (1.0 / kStepsPerVoxel) + beyond[axis];
      }
    }
    return source_of(source, region, box);
  }

  /// Voxels that stay where they are count too.
  Region source_of(const Geometry& source, const Region& region, const RestBox& box) const {
    if (!rest_outside_) return source_box(source, output(), box.low, box.high);
    return source_box(source, output(), glm::min(box.low, glm::dvec3(region.begin)),
                      glm::max(box.high, glm::dvec3(region.end - std::int64_t{1})));
  }

  bool can_gather() const { return lattice_->field().has_steps() && !rest_outside_; }
  bool can_write_plainly() const override { return can_gather(); }
  bool can_map_plainly(const SlabWriter& writer) const { return can_gather() && !writer.wants_of_owners(); }
  /// Whether all that is wanted is who owns each voxel.
  bool can_find_owners(const SlabWriter& writer) const {
    // Decided for the whole output: records of tetrahedra are made once a field, however small the boxes are.
    return can_gather() && Gather::can_find_owners(*lattice_, {glm::i64vec3(0), output().size}) && frame_.coarse &&
           !streamed_ && writer.wants_tetrahedra() && !writer.wants_jacobian() && !writer.wants_owners() &&
           !writer.wants_places();
  }
  std::int64_t work_bytes(const SlabWriter& writer) const override {
    if (can_find_owners(writer)) return std::int64_t{sizeof(std::uint8_t)};
    return Mapped::bytes(frame_.coarse) + (can_map_plainly(writer) ? 0 : Claims::kBytes);
  }

  void write_plainly(const SlabBox& box, SlabWriter& writer) override {
    const auto run = [&](const auto& sink) {
      const Gather::Counters found = gather_.run(*lattice_, box, sink, stream_, {reuse_, seen_ ? &*seen_ : nullptr});
      if (reuse_ == Reuse::now && gather_.changed()) changed_ = *gather_.changed();  // then the box is all there is
      plainly_covered_ += found.covered;
      plainly_uncovered_ += static_cast<std::uint64_t>(box.count()) - found.covered;
      count_paths(box, found);
    };
    with_rounding(frame_.coarse,
                  [&](auto rounding) { std::visit(run, writer.plain_sink<decltype(rounding)::value>(box)); });
  }

  void map_box(const SlabBox& box, SlabWriter& writer) override {
    const auto voxels = static_cast<std::size_t>(box.count());
    if (can_find_owners(writer)) {
      std::uint32_t* const owner = writer.tetrahedra(box);
      count_paths(box, gather_.find_owners(*lattice_, box, {box, owner, nullptr}, stream_));
      mapped_of_owners_kernel<<<blocks_for(box.count()), kThreads, 0, stream_>>>(
          owner, box.count(), mapped_.reserve_without_offsets(voxels).mapped);
      TETWARP_CUDA_TRY(cudaGetLastError());
      return;
    }
    const VoxelMapping mapped{mapped_.reserve(voxels, frame_.coarse), writer.jacobian(), writer.owners(),
                              writer.tetrahedra(box)};
    if (can_map_plainly(writer)) {
      with_rounding(frame_.coarse, [&](auto rounding) {
        count_paths(box,
                    gather_.run(*lattice_, box, offset_sink<decltype(rounding)::value>(box, mapped.places), stream_));
      });
      return;
    }
    const DeviceField& field = lattice_->field();
    claims_.claim(field, box, writer.wants_owners(), stream_);
    map_voxels_kernel<<<blocks_for(box.count()), kThreads, 0, stream_>>>(
        field, frame_, rest_outside_, box, claims_.owner(), writer.wants_owners() ? claims_.owners() : nullptr, mapped,
        counts_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    paths_.claimed += static_cast<std::uint64_t>(voxels);
  }

  /// A voxel that the walk left to the claims counts there.
  void count_paths(const SlabBox& box, const Gather::Counters& found) {
    const auto voxels = static_cast<std::uint64_t>(box.count());
    const std::uint64_t claimed = std::min<std::uint64_t>(found.claimed, voxels),
                        walked = std::min<std::uint64_t>(found.queued, voxels - claimed);
    paths_.claimed += claimed;
    paths_.walked += walked;
    paths_.gathered += voxels - claimed - walked;
  }

  void describe_field(Report& report) const override {
    report.inverted = statistics_.inverted;
    report.degenerate = statistics_.degenerate;
    report.jacobian_min = statistics_.jacobian_min;
    report.jacobian_max = statistics_.jacobian_max;
  }

  FieldView field_;     ///< as it was given
  LatticeFrame frame_;  ///< of the whole lattice
  FieldStatistics statistics_;
  bool rest_outside_ = false, wants_range_ = true;
  bool streamed_ = false;          ///< `lattice_` holds a part
  Slices held_;                    ///< that part; empty: none
  std::vector<SliceReach> reach_;  ///< of each slice of vertices, where it was asked for
  DeviceBuffer<SliceReach> reach_on_device_;
  std::uint64_t vertex_bytes_ = kStepVertexBytes;
  std::uint64_t most_bytes_ = UINT64_MAX;  ///< of a field that is held whole
  DeviceBuffer<glm::vec3> displacement_;   ///< of a field on the host
  std::optional<LatticeOnDevice> lattice_{std::in_place};
  Gather gather_;
  Claims claims_;
  Reuse reuse_ = Reuse::nothing;        ///< of the call
  std::optional<SeenSource> seen_;      ///< of the call, where what is not seen may be left
  std::vector<UpdatedTarget> updated_;  ///< what the last call updated; empty if that was none
  std::vector<Region> changed_;         ///< by `update`
};

}  // namespace

}  // namespace cuda_detail

std::unique_ptr<ForwardResampler> make_cuda_resampler(const Geometry& output, int device, const Limits& limits) {
  return std::make_unique<LatticeOrMesh>(
      output, [=] { return std::make_unique<cuda_detail::LatticeResampler>(output, device, limits); },
      [=] { return cuda_detail::make_mesh_resampler(output, device, limits); });
}

}  // namespace tetwarp
