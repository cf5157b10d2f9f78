// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "cuda/lattice/lattice.cuh"
#include "cuda/lattice/lattice_part.h"
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
  /// Those that were reserved last.
  const MappedVoxels& voxels() const { return voxels_; }

 private:
  DeviceBuffer<std::uint8_t> mapped_;
  DeviceBuffer<glm::vec3> offset_;
  DeviceBuffer<FixedOffset> fixed_;
  MappedVoxels voxels_{};
};

/// U of a voxel of a coarse field, 2^-23 voxel, as fast ways have it.
struct FixedU {
  glm::i32vec3 u;  ///< modulo 2^32
  bool any;        ///< whether it is usable
};

/// Whether fast arithmetic gave where a voxel comes from.
/// @param moved  deformed minus undeformed place, 2^-12 voxel, NaN where it did not; or of a coarse field
__device__ inline bool is_any(const glm::vec3& moved) { return moved.x == moved.x; }
__device__ inline bool is_any(const FixedU& u) { return u.any; }
/// The same as an offset, as sinks write it.
__device__ inline glm::vec3 offset_of(const glm::vec3& moved) { return detail::to_offset(moved); }
__device__ inline FixedOffset offset_of(const FixedU& u) { return fixed_offset(glm::i64vec3(u.u)); }

/// Calls `work` with the Lerp of a field, as a constant.
template <class Work>
void with_rounding(bool coarse, Work&& work) {
  if (coarse) {
    work(std::integral_constant<Lerp, Lerp::fused>());
  } else {
    work(std::integral_constant<Lerp, Lerp::separate>());
  }
}

/// How the voxels of sources and outputs on one grid lie, and where a voxel comes from. All sinks that sample share it;
/// `OffsetSink` (cuda/owners/gather.cuh) describes what a sink is.
struct SinkLayout {
  glm::ivec3 last;  ///< last voxel of the whole source grid
  /// Values from one row, and one slice, to the next, in what is buffered of the source.
  int row, slice;
  int output_row, output_slice;

  __device__ int address(const glm::ivec3& voxel) const {
    return voxel.z * output_slice + voxel.y * output_row + voxel.x;
  }
  __device__ int per_slice() const { return output_slice; }
  /// Whether all voxels of a half-open box of the source are well inside the source.
  __device__ bool surrounds(const glm::ivec3& begin, const glm::ivec3& end) const {
    return (begin.x >= 0) & (begin.y >= 0) & (begin.z >= 0) & (end.x <= last.x) & (end.y <= last.y) & (end.z <= last.z);
  }
  /// Number that names a voxel for `locate`; it grows by `per_source_slice` along k.
  __device__ unsigned column(const glm::ivec3& voxel) const;
  __device__ unsigned per_source_slice() const { return static_cast<unsigned>(slice); }
  /// A place in the source: offset of its whole voxel, and the fraction.
  struct Origin {
    int base;
    glm::vec3 fraction;
  };
  /// Computes where a voxel comes from, for the walk of a column.
  /// @tparam kInside  whether that is known to be well inside the source
  /// @param column  what `column` gave for the voxel
  /// @param moved   deformed minus undeformed place, 2^-12 voxel; may be NaN
  /// @return whether it is well inside the source, and `moved` is not NaN
  template <bool kInside>
  __device__ bool locate(const glm::ivec3& voxel, unsigned column, const glm::vec3& moved, Origin& origin) const;
  /// The same in a coarse field.
  template <bool kInside>
  __device__ bool locate(const glm::ivec3& voxel, unsigned column, const FixedU& u, Origin& origin) const;
  /// Computes where a single voxel comes from.
  /// @param moved  deformed minus undeformed place, 2^-12 voxel; may be NaN
  /// @return whether it is well inside the source, and `moved` is not NaN
  __device__ bool locate(const glm::ivec3& voxel, const glm::vec3& moved, Origin& origin) const;
  __device__ bool locate(const glm::ivec3& voxel, const FixedU& u, Origin& origin) const;
  /// Computes where a voxel comes from, by its exact offset.
  /// @return whether that is inside the source
  __device__ bool locate_exactly(const glm::ivec3& voxel, const glm::vec3& u, Origin& origin) const;
  __device__ bool locate_exactly(const glm::ivec3& voxel, const FixedOffset& u, Origin& origin) const;
  __device__ int source_index(const glm::ivec3& voxel) const { return voxel.z * slice + voxel.y * row + voxel.x; }

 private:
  /// Clamps a place to the source. @return whether it is inside
  __device__ bool clamp(glm::ivec3 base, Origin& origin) const;
};

/// Samples the voxels of one volume: linear interpolation of integers that float holds, without padding, source and
/// output on one grid. The result has the bits of `sample_voxel`.
/// @tparam kRounding  fused for coarse fields: `start` and `write` are then given `FixedU` and `FixedOffset`
template <class V, Lerp kRounding>
struct VoxelSink : SinkLayout {
  static constexpr Lerp kLerp = kRounding;
  static constexpr bool kIsWide = false;  ///< whether it takes many registers

  const V* source;  ///< address of voxel (0, 0, 0), which need not be buffered; so is `output`
  V background;
  V* output;

  /// A voxel well inside the source for which reading has begun.
  struct Pending {
    bool any = false;
    glm::vec3 fraction;
    int corners[8];
  };

  /// Begins to write a voxel that a tetrahedron owns, if it is `wanted` and comes from well inside the source;
  /// otherwise nothing is pending. Voxels from the border of the source are for `write`.
  /// @param moved  deformed minus undeformed place, 2^-12 voxel; or a FixedU
  template <class Moved>
  __device__ void start(int address, const glm::ivec3& voxel, const Moved& moved, bool wanted, Pending& pending) const;
  /// Writes the pending voxel, if there is one.
  /// @param address  that with which `start` was called
  __device__ void finish(int address, const Pending& pending) const;
  /// Begins to read the source for a voxel, if it is `wanted`.
  __device__ void begin(const Origin& origin, bool wanted, Pending& pending) const;
  /// Writes the voxel for which reading began last; an undefined value if there is none.
  __device__ void end(int address, const Pending& pending) const;
  /// Writes a voxel that a tetrahedron owns.
  /// @return whether it comes from inside the source
  template <class Offset>
  __device__ bool write(int address, const glm::ivec3& voxel, const Offset& u) const;
  /// Copies voxels of a column along k that stay where they are: those of the kCount voxels from `voxel` on whose bits
  /// are set.
  template <int kCount>
  __device__ void copy(const glm::ivec3& voxel, std::uint32_t wanted) const;
  __device__ void nothing(int address) const { output[address] = background; }
};

constexpr int kMostSinkVolumes = 8;

/// One of several volumes.
struct SinkVolume {
  const void* source;  ///< as in VoxelSink
  void* output;
  VoxelType type;  ///< u8, i16 or u16
  bool votes;      ///< whether it is sampled by vote; otherwise linearly
  int background;
};

/// Samples the voxels of several volumes on one grid. Where a voxel comes from is computed once. Its members do what
/// those of VoxelSink do.
///
/// @tparam V  type of all volumes, which are then linear; void: any types
template <class V, Lerp kRounding>
struct VolumesSink : SinkLayout {
  static constexpr Lerp kLerp = kRounding;
  static constexpr bool kIsWide = true;

  SinkVolume volumes[kMostSinkVolumes];
  int count;

  /// Number of volumes whose source voxels are read ahead, in `begin`; those of other volumes are read in `finish`.
  static constexpr int kOnTheWay = 2;
  struct Pending {
    bool any = false;
    Origin origin;
    int corners[kOnTheWay][8];
  };
  template <class Moved>
  __device__ void start(int address, const glm::ivec3& voxel, const Moved& moved, bool wanted, Pending& pending) const;
  __device__ void finish(int address, const Pending& pending) const;
  __device__ void begin(const Origin& origin, bool wanted, Pending& pending) const;
  __device__ void end(int address, const Pending& pending) const { finish(address, pending); }
  template <class Offset>
  __device__ bool write(int address, const glm::ivec3& voxel, const Offset& u) const;
  template <int kCount>
  __device__ void copy(const glm::ivec3& voxel, std::uint32_t wanted) const;
  __device__ void nothing(int address) const;

 private:
  /// Calls `work` with a null pointer to the volume's type.
  template <class Work>
  __device__ void with_type(const SinkVolume& volume, Work&& work) const;
  __device__ void read(const SinkVolume& volume, const Origin& origin, const glm::ivec3& step, int (&corners)[8]) const;
  __device__ void put(const SinkVolume& volume, int address, int value) const;
  __device__ void put(const SinkVolume& volume, int address, const int (&corners)[8], const glm::vec3& t) const;
};

template <Lerp kRounding>
using AnyVoxelSink = std::variant<VoxelSink<std::uint8_t, kRounding>, VoxelSink<std::int16_t, kRounding>,
                                  VoxelSink<std::uint16_t, kRounding>, VolumesSink<std::int16_t, kRounding>,
                                  VolumesSink<void, kRounding>>;

/// Samples targets and writes maps, box after box, and copies results to the host while the next box is computed. It
/// knows nothing of fields.
///
/// Everything on the device is kept from call to call.
class SlabWriter {
 public:
  SlabWriter(const Geometry& output, int device, Uploads& uploads)
      : output_(output), uploads_(uploads), downloads_(device) {}

  /// Takes the targets and maps of a call, which were checked.
  /// @throws InputError for memory that is not where a view says
  void begin(std::span<const Target> targets, const Maps& maps, cudaStream_t stream);

  bool wants_jacobian() const { return maps_.jacobian.voxels != nullptr; }
  bool wants_owners() const { return maps_.owners.voxels != nullptr; }
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
    std::size_t coverage = kNone, inverse_mm = kNone, jacobian = kNone, owners = kNone;
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
  std::span<std::unique_ptr<DeviceTarget>> targets_;  ///< of this call, the first of `kept_`
  DeviceBuffer<std::byte> sources_, results_;
  Layout layout_;  ///< of the box
  std::size_t box_bytes_ = 0;
  int boxes_ = 1, current_ = 0;
  Event computed_, copied_[2];
};

}  // namespace tetwarp::cuda_detail
