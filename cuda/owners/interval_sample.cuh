// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/sample_column.cuh"
#include "cuda/owners/interval_tile.cuh"

/// The resolve of a tile: from the intervals of its rows to the values of its voxels. For interval_kernel.cuh alone.
namespace tetwarp::cuda_detail {

namespace {

/// Copies a tile at rest, a column a lane.
template <class Sink>
__device__ void copy_tile(const IntBox& voxels, int thread, const Sink& sink) {
  constexpr int kAtOnce = 8;
  const glm::ivec3 size = voxels.end - voxels.begin;
  const int lane = thread & 31, y = thread / 32;
  if (lane >= size.x || y >= size.y) return;
  const glm::ivec3 at = voxels.begin + glm::ivec3(lane, y, 0);
  for (int z = 0; z < size.z; z += kAtOnce)
    sink.template copy<kAtOnce>(at + glm::ivec3(0, 0, z), ~0u >> max(32 - (size.z - z), 0));
}

/// A voxel whose owner has no map that may be used. Rarely called, so out of line, with everything by value.
template <class Shape, class Sink>
__device__ __noinline__ bool write_slowly(const Shape& shape, const Sink& sink, unsigned number, int out, glm::ivec3 at,
                                          glm::i32vec3 signs) {
  return sink.write(out, at, fixed_offset(coarse_u(shape.tetrahedron(number), at, signs)));
}

/// Whether a sink gets the numbers of owners, so that no map is needed.
template <class Sink>
constexpr bool kIsOfOwners = std::is_same_v<Sink, OwnerSink>;

/// Gives a sink the owners of the voxels of a tile; a lane a column along k.
template <class Shape>
__device__ void write_owners(const IntervalTile<Shape>& tile, const OwnerSink& sink) {
  const int lane = tile.lane(), y = tile.warp();
  if (lane >= tile.size.x || y >= tile.size.y) return;
  int out = sink.address(tile.voxels.begin + glm::ivec3(lane, y, 0));
  for (int z = 0; z < tile.size.z; ++z, out += sink.per_slice()) {
    const unsigned slot = tile.memory.owner_of(z * kTileJ + y, lane);
    sink.owner[out] = slot == IntervalTile<Shape>::Memory::kNobody ? kNoTetrahedron : tile.memory.numbers[slot];
  }
}

/// Samples the columns of a tile along k, a lane each.
template <class Shape, class Sink>
struct ColumnSampler {
  const IntervalTile<Shape>& tile;
  const Sink& sink;

  static constexpr unsigned kNobody = IntervalTile<Shape>::Memory::kNobody;

  template <bool kAllUsable>
  __device__ auto maps() const {
    return CoarseMaps<kAllUsable>{tile.memory.prepared, tile.memory.usable};
  }

  /// The column of this lane.
  /// @tparam kPlain  whether all voxels have owners with usable maps, and come from well inside the source
  /// @return how many are covered
  template <bool kPlain>
  __device__ unsigned sample() const {
    const int lane = tile.lane(), y = tile.warp();
    if (lane >= tile.size.x || y >= tile.size.y) return 0;
    const unsigned* starts = &tile.memory.starts[y];
    const unsigned short* owners = tile.memory.owners[y];
    const unsigned up_to_lane = lowest_bits(lane + 1);
    const auto next_slot = [&]() -> unsigned {
      const unsigned slot = RowOwner::Slot::get(owners[last_bit(*starts & up_to_lane)]);
      starts += kTileJ;
      owners += kTileJ * kTileI;
      return slot;
    };
    return sample_column<kPlain>(sink, maps<kPlain>(), tile.voxels.begin + glm::ivec3(lane, y, 0),
                                 glm::ivec3(lane, y, 0), tile.size.z, next_slot,
                                 [&](int z) { return finish(lane, y, z); });
  }

  /// A voxel that `sample` has not written. @return whether it is covered
  __device__ bool finish(int x, int y, int z) const {
    const glm::ivec3 in_tile(x, y, z), at = tile.voxels.begin + in_tile;
    const unsigned slot = tile.memory.owner_of(z * kTileJ + y, x);
    if (slot == kNobody) {
      sink.nothing(sink.address(at));
      return false;
    }
    return finish_voxel(sink, maps<false>(), slot, at, in_tile, [&](int out) {
      return write_slowly(tile.task.shape, sink, tile.memory.numbers[slot], out, at, tile.signs);
    });
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
