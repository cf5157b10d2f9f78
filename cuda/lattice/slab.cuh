// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "cuda/lattice/lattice.cuh"
#include "cuda/lattice/lattice_part.h"
#include "cuda/lattice/sinks.cuh"
#include "cuda/runtime/host_copies.h"
#include "deform/core/coarse_map.h"
#include "deform/core/gather.h"
#include "deform/core/sample_voxel.h"
#include "deform/core/visit_cell.h"

namespace tetwarp::cuda_detail {

/// A box of fewer than 2^32 voxels, as a kernel sees it.
struct SlabBox {
  glm::i64vec3 begin, size;

  __host__ __device__ std::int64_t count() const { return size.x * size.y * size.z; }
  __device__ glm::i64vec3 voxel(std::int64_t n) const {  // long divisions are slow
    const auto number = static_cast<unsigned>(n), row = static_cast<unsigned>(size.x),
               rows = static_cast<unsigned>(size.y);
    return begin + glm::i64vec3(number % row, number / row % rows, number / row / rows);
  }
  __device__ std::int64_t offset(const glm::i64vec3& voxel) const {
    const glm::i64vec3 at = voxel - begin;
    return (at.z * size.y + at.y) * size.x + at.x;
  }
};

/// Where a kernel writes the voxels of a slab: a part of a larger volume, or a buffer of the slab's own.
template <class V>
struct Destination {
  V* voxels;  ///< of `begin`
  glm::i64vec3 begin;
  std::int64_t row, slice;  ///< in voxels

  /// In voxels, from `voxels` on.
  __device__ std::int64_t index(const glm::i64vec3& voxel) const {
    return (voxel.z - begin.z) * slice + (voxel.y - begin.y) * row + (voxel.x - begin.x);
  }
};

/// Counts of a report, on the device.
struct Counts {
  unsigned long long covered, uncovered, clamped, padded, conflicts, multiply_owned;
};

/// Where each voxel of a box comes from, in the order of the voxels, as a kernel sees it. One of both kinds of offsets
/// is null.
struct MappedVoxels {
  std::uint8_t* mapped;  ///< 1 where the voxel comes from anywhere, else 0
  glm::vec3* offset;     ///< undeformed minus deformed place, voxels: of dense and pull fields
  FixedOffset* fixed;    ///< the same of coarse fields

  /// @return whether a voxel comes from inside the source of a plan
  template <class V>
  __device__ bool source_place(const SamplePlan<V>& plan, const glm::i64vec3& voxel, std::int64_t n,
                               Place& place) const {
    if (mapped[n] == 0) return false;
    return fixed ? tetwarp::source_place(plan, voxel, fixed[n], place)
                 : tetwarp::source_place(plan, voxel, offset[n], place);
  }
  __device__ Lerp rounding() const { return fixed ? Lerp::fused : Lerp::separate; }
  __device__ glm::dvec3 in_double(std::int64_t n) const {
    return fixed ? tetwarp::in_double(fixed[n]) : tetwarp::in_double(offset[n]);
  }
  /// Voxels stay where they are.
  __device__ void put_nothing(std::int64_t n) const {
    if (fixed) {
      fixed[n] = {glm::i32vec3(0), glm::vec3(0)};
    } else {
      offset[n] = glm::vec3(0);
    }
  }
  /// The place of a voxel that a tetrahedron owns.
  __device__ void put(std::int64_t n, const Tetrahedron& t, const glm::i64vec3& voxel,
                      const glm::i32vec3& signs) const {
    if (fixed) {
      fixed[n] = fixed_offset(coarse_u(t, glm::ivec3(voxel), signs));
    } else {
      offset[n] = interpolate_u(t, detail::to_steps(voxel), signs);
    }
  }
};

/// The memory of `MappedVoxels`.
class Mapped {
 public:
  /// Bytes for each voxel. @param coarse  whether the field is
  static std::int64_t bytes(bool coarse) {
    return static_cast<std::int64_t>(sizeof(std::uint8_t) + (coarse ? sizeof(FixedOffset) : sizeof(glm::vec3)));
  }

  MappedVoxels reserve(std::size_t voxels, bool coarse) {
    voxels_ = {mapped_.reserve(voxels), coarse ? nullptr : offset_.reserve(voxels),
               coarse ? fixed_.reserve(voxels) : nullptr};
    return voxels_;
  }
  /// Where no offsets are wanted.
  MappedVoxels reserve_without_offsets(std::size_t voxels) {
    voxels_ = {mapped_.reserve(voxels), nullptr, nullptr};
    return voxels_;
  }
  /// Those that were reserved last.
  const MappedVoxels& voxels() const { return voxels_; }

 private:
  DeviceBuffer<std::uint8_t> mapped_;
  DeviceBuffer<glm::vec3> offset_;
  DeviceBuffer<FixedOffset> fixed_;
  MappedVoxels voxels_{};
};

/// Samples targets and writes maps, box after box, and copies results to the host while the next box is computed. It
/// knows nothing of fields.
///
/// Everything on the device is kept from call to call.
class SlabWriter {
 public:
  SlabWriter(const Geometry& output, int device, Uploads& uploads)
      : output_(output), uploads_(uploads), downloads_(device) {}

  /// Takes the targets and maps of a call for a region, which were checked.
  /// @throws InputError for memory that is not where a view says
  void begin(std::span<const Target> targets, const Maps& maps, const Region& region, cudaStream_t stream);

  bool wants_jacobian() const { return maps_.jacobian.voxels != nullptr; }
  bool wants_owners() const { return maps_.owners.voxels != nullptr; }
  bool wants_tetrahedra() const { return maps_.tetrahedra.voxels != nullptr; }
  /// Whether the places are wanted that voxels come from.
  bool wants_places() const { return !targets_.empty() || maps_.inverse_mm.voxels != nullptr; }
  /// Whether a map is filled for which owners must be known.
  bool wants_of_owners() const { return wants_jacobian() || wants_owners() || wants_tetrahedra(); }
  /// Whether the call fills volumes that a VoxelSink or VolumesSink can sample, and no maps.
  bool is_plain() const;

  /// Number of voxels that may be worked on at a time.
  /// @param work_bytes  working memory for each voxel; 0: `plain_sink` is used
  std::int64_t box_voxels(std::int64_t work_bytes) const;
  /// Device memory for the results of `boxes` boxes.
  std::uint64_t result_bytes(std::int64_t voxels, int boxes) const { return boxes * layout(voxels).bytes; }
  /// Device memory for slices of those sources that lie in host memory.
  /// @param slices_of  the slices that are needed of a source
  std::uint64_t source_bytes(const std::function<Slices(const ConstVolumeView& source)>& slices_of) const;

  std::uint64_t held_source_bytes() const { return sources_.capacity(); }
  std::uint64_t held_result_bytes() const { return results_.capacity(); }
  void release();

  void reserve(std::uint64_t source_bytes, std::int64_t box_voxels, int boxes);
  /// Uploads slices of those sources that lie in host memory.
  void hold_sources(const std::function<Slices(const ConstVolumeView& source)>& slices_of);

  /// Prepares for a box, before its voxels are found.
  void begin_box(const SlabBox& box);
  /// The map of Jacobian determinants of the box; null if it is not filled.
  float* jacobian() const { return place<float>(layout_.jacobian); }
  /// The map of numbers of owners of the box; null if it is not filled.
  std::uint16_t* owners() const { return place<std::uint16_t>(layout_.owners); }
  /// The map of numbers of tetrahedra of the box; null if it is not filled. In device memory it is written in place
  /// where its rows are those of the region.
  std::uint32_t* tetrahedra(const SlabBox& box) const;
  void write(const SlabBox& box, const MappedVoxels& mapped, Counts* counts);
  /// The sink that writes the voxels of the box, instead of `write`, if the call `is_plain`.
  /// @tparam kRounding  fused for coarse fields
  template <Lerp kRounding>
  AnyVoxelSink<kRounding> plain_sink(const SlabBox& box);
  /// Gives the results of the box to the views.
  void end_box(const SlabBox& box);
  /// Waits until the host has everything.
  void finish();
  /// Waits until nothing runs any more, whether or not it failed.
  void wait_for_all() noexcept;

 private:
  /// A target, and what of it lies on the device.
  struct DeviceTarget {
    Target target;           ///< its source is what the device holds
    ConstVolumeView source;  ///< as it was given
    SourceRelation relation;
    DeviceBuffer<double> slices;          ///< of an uneven source
    DeviceBuffer<long long> first, last;  ///< its sampled slices
  };
  /// Offsets in bytes at which the results of a box begin; kNone: not filled.
  struct Layout {
    static constexpr std::size_t kNone = SIZE_MAX;

    std::vector<std::size_t> voxels;  ///< of each target
    std::size_t coverage = kNone, inverse_mm = kNone, jacobian = kNone, owners = kNone, tetrahedra = kNone;
    std::size_t bytes = 0;
  };

  Layout layout(std::int64_t voxels) const;
  template <class T>
  T* place(std::size_t offset) const {
    if (offset == Layout::kNone) return nullptr;
    return reinterpret_cast<T*>(results_.data() + static_cast<std::size_t>(current_) * box_bytes_ + offset);
  }
  template <class V>
  Destination<V> destination(std::size_t number, const SlabBox& box);
  bool is_plain(const DeviceTarget& target) const;
  /// Of a plain target, what a sink knows of it.
  template <class V>
  struct PlainVolume {
    const V* source;
    V background;
    V* output;
  };
  template <class V>
  PlainVolume<V> plain_volume(std::size_t number, const SlabBox& box);
  /// @tparam V  of the first target
  template <class V>
  SinkLayout sink_layout(const SlabBox& box);
  template <class V, Lerp kRounding>
  VolumesSink<V, kRounding> volumes_sink(const SlabBox& box);
  void write_target(std::size_t number, const SlabBox& box, const MappedVoxels& mapped, std::uint8_t* coverage,
                    Counts* counts);
  void give(const VolumeView& view, const SlabBox& box, std::size_t offset);
  bool has_results_on_host() const;

  const Geometry& output_;
  Uploads& uploads_;
  Downloads downloads_;
  Maps maps_;
  cudaStream_t stream_ = nullptr;
  std::vector<std::unique_ptr<DeviceTarget>> kept_;
  bool tetrahedra_in_place_ = false;                  ///< whether boxes write that map where it lies
  std::span<std::unique_ptr<DeviceTarget>> targets_;  ///< of this call, the first of `kept_`
  DeviceBuffer<std::byte> sources_, results_;
  Layout layout_;  ///< of the box
  std::size_t box_bytes_ = 0;
  int boxes_ = 1, current_ = 0;
  Event computed_, copied_[2];
};

}  // namespace tetwarp::cuda_detail
