// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <type_traits>
#include <variant>

#include "cuda/lattice/lattice.cuh"
#include "deform/core/coarse_map.h"
#include "deform/core/gather.h"
#include "deform/core/sample_voxel.h"

// Where kernels put voxels whose places they found on the way: sources and outputs on one grid.

namespace tetwarp::cuda_detail {

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

}  // namespace tetwarp::cuda_detail
