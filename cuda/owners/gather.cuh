// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "cuda/owners/claim.cuh"
#include "cuda/owners/coverage.cuh"
#include "cuda/owners/interval_raster.cuh"
#include "cuda/runtime/stream.h"
#include "deform/core/gather.h"

namespace tetwarp::cuda_detail {

/// Receives what a gather finds, for later sampling: for each voxel of a box, whether a tetrahedron owns it and where
/// it comes from.
///
/// Every sink of a gather has an address for each voxel, where it writes; it grows by `per_slice` along k.
///
/// @tparam kRounding  fused for coarse fields: places come as `FixedU` and `FixedOffset` then, else as glm::vec3
template <Lerp kRounding>
struct OffsetSink {
  static constexpr bool kIsWide = false;
  static constexpr Lerp kLerp = kRounding;
  using Offset = std::conditional_t<kRounding == Lerp::fused, FixedOffset, glm::vec3>;
  using Moved = std::conditional_t<kRounding == Lerp::fused, FixedU, glm::vec3>;

  SlabBox box;
  std::uint8_t* mapped;
  Offset* offset;

  __device__ int address(const glm::ivec3& voxel) const { return static_cast<int>(box.offset(glm::i64vec3(voxel))); }
  __device__ int per_slice() const { return static_cast<int>(box.size.x * box.size.y); }
  /// This sink reads nothing, so nothing is pending.
  struct Pending {
    bool any;
    Offset u;
  };
  __device__ void start(int address, const glm::ivec3& voxel, const Moved& moved, bool wanted, Pending& pending) const {
    pending.any = wanted && write(address, voxel, offset_of(moved));
  }
  __device__ void finish(int, const Pending&) const {}
  struct Origin {
    Offset u;
  };
  __device__ bool surrounds(const glm::ivec3&, const glm::ivec3&) const { return false; }
  __device__ unsigned column(const glm::ivec3&) const { return 0; }
  __device__ unsigned per_source_slice() const { return 0; }
  template <bool kInside>
  __device__ bool locate(const glm::ivec3&, unsigned, const Moved& moved, Origin& origin) const {
    origin.u = offset_of(moved);
    return is_any(moved);
  }
  __device__ void begin(const Origin& origin, bool, Pending& pending) const { pending.u = origin.u; }
  __device__ void end(int address, const Pending& pending) const { write(address, {}, pending.u); }
  /// @return whether the voxel counts as covered
  __device__ bool write(int address, const glm::ivec3&, const Offset& u) const {
    mapped[address] = 1;
    offset[address] = u;
    return true;
  }
  /// Voxels of a column along k that stay where they are.
  template <int kCount>
  __device__ void copy(const glm::ivec3& voxel, std::uint32_t wanted) const {
    for (int n = 0, to = address(voxel); n < kCount; ++n, to += per_slice())
      if ((wanted >> n & 1) != 0) write(to, {}, Offset{});
  }
  __device__ void nothing(int address) const {
    mapped[address] = 0;
    offset[address] = Offset{};
  }
};

/// The sink that writes the places of a box. @param to  with offsets of the kind that `kRounding` has
template <Lerp kRounding>
OffsetSink<kRounding> offset_sink(const SlabBox& box, const MappedVoxels& to) {
  if constexpr (kRounding == Lerp::fused) {
    return {box, to.mapped, to.fixed};
  } else {
    return {box, to.mapped, to.offset};
  }
}

/// RUN(type); for all sinks of places and values.
#define TETWARP_FOR_EACH_SINK(RUN, kRounding) \
  RUN(OffsetSink<kRounding>);                 \
  RUN(VolumesSink<void, kRounding>);          \
  RUN(VolumesSink<std::int16_t, kRounding>);  \
  RUN(VoxelSink<std::uint8_t, kRounding>);    \
  RUN(VoxelSink<std::int16_t, kRounding>);    \
  RUN(VoxelSink<std::uint16_t, kRounding>)

/// Finds the owners of voxels by marching along k and predicting each owner from the one before.
///
/// Voxels that the march cannot settle in float go into a queue, and from there to a walk with exact integers. Voxels
/// that may have several owners, and those that the walk leaves, are claimed. So this way is right for every field with
/// whole steps.
class Gather {
 public:
  using Counters = GatherCounters;

  /// Finds the voxels of `box`; waits for the stream.
  template <class Sink>
  Counters run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream,
               const TileReuse& reuse = {});

  /// Whether `find_owners` serves a box: coarse lattices with large cells.
  static bool can_find_owners(const LatticeOnDevice& lattice, const SlabBox& box);
  /// Finds the numbers of the owners of all voxels of `box`; waits for the stream.
  Counters find_owners(const LatticeOnDevice& lattice, const SlabBox& box, const OwnerSink& sink, cudaStream_t stream) {
    return run_intervals(lattice, box, sink, stream, {});
  }

  /// With Reuse::now: outside which regions the last run gave the sink nothing; none where it gave it all.
  const std::optional<std::vector<Region>>& changed() const { return intervals_.changed(); }

  /// To be called when the field changes.
  void forget_field() {
    claims_.forget_field();
    intervals_.forget_field();
    has_maps_ = false;
  }

  /// A voxel that the march could not settle.
  struct QueuedVoxel {
    int voxel;      ///< offset in the box
    float x, y, z;  ///< where it may come from: undeformed place, cells; perhaps not finite
  };

 private:
  /// Whether so many tetrahedra are inverted that walks mostly fail. Then voxels whose owner is not predicted are
  /// claimed.
  static bool is_mostly_folded(const LatticeOnDevice& lattice);
  /// The way for large cells.
  template <class Sink>
  Counters run_intervals(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream,
                         const TileReuse& reuse);
  /// Claims the voxels that the coverage calls `several`.
  template <class Task, class Sink>
  void claim_several(const Task& task, const DeviceField& field, const Sink& sink, cudaStream_t stream);
  Counters counters(cudaStream_t stream);
  /// The maps of the tetrahedra of a coarse lattice; null where they take too much memory.
  const int4* maps_of(const StepLattice& lattice, const SlabBox& box, cudaStream_t stream);

  Coverage coverage_;
  DeviceBuffer<int4> maps_;  ///< `map_table.cuh`
  bool has_maps_ = false;    ///< whether they are those of the field
  Claims claims_;
  IntervalRaster intervals_;
  DeviceBuffer<glm::vec3> seeds_;
  DeviceBuffer<std::uint8_t> resting_;
  DeviceBuffer<QueuedVoxel> queue_;
  DeviceBuffer<unsigned> numbered_, claimed_;
  PinnedBuffer<unsigned> several_in_slice_;
  PinnedBuffer<Counters> found_;
  /// Of the device of the first run.
  struct Beside {
    Stream stream;
    Event begun, seeded;
  };
  std::optional<Beside> beside_;
};

}  // namespace tetwarp::cuda_detail
