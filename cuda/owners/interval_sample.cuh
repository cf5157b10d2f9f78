// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/sample_column.cuh"
#include "cuda/owners/interval_tile.cuh"

/// The resolve of a tile: from the intervals of its rows to the values of its voxels. For interval_raster.cu alone.
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

/// Whether a tile lies within the undeformed lattice, and all cells that reach it there are at rest. To be called by
/// all threads together.
__device__ bool is_all_at_rest(const TileTask& task, const IntBox& voxels, int thread) {
  const glm::ivec3 size(task.lattice.cell), low = voxels.begin * kStepsPerVoxel - glm::ivec3(task.lattice.first),
                                            high = (voxels.end - 1) * kStepsPerVoxel - glm::ivec3(task.lattice.first);
  bool rests = true;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis)
    rests = rests && low[axis] >= 0 && high[axis] <= task.lattice.cells[axis] * size[axis];
  if (!rests) return false;
  // Nudges are less than a step; a voxel on the border of two cells may be either's.
  const glm::ivec3 first = glm::max(low - 1, glm::ivec3(0)) / size,
                   count = glm::min((high + 1) / size, task.lattice.cells - 1) - first + 1;
  for (int z = thread / 32; z < count.z; z += kTileJ) {
    for (int y = 0; y < count.y; ++y) {
      const std::int64_t row = std::int64_t{first.z + z} * task.lattice.cells.y + first.y + y,
                         at = (row * task.lattice.cells.x + first.x) * kTetrahedraPerCell;
      for (int n = thread & 31; n < count.x * kTetrahedraPerCell; n += 32)
        rests = rests && RecordFlags::AtRest::get(static_cast<unsigned>(task.records.box(at + n).w)) != 0;
    }
  }
  return __syncthreads_and(rests ? 1 : 0) != 0;
}

/// The maps of the tetrahedra in the slots, in the place of their lines, from the first voxel of the tile on.
__device__ void read_maps(const IntervalTile& tile) {
  TileMemory& memory = tile.memory;
#pragma unroll 1
  for (int slot = tile.thread; slot < tile.count; slot += kTileThreads) {
    const Records& records = tile.task.records;
    const unsigned number = memory.numbers[slot];
    memory.usable[slot] = RecordFlags::Usable::get(static_cast<unsigned>(records.box(number).w));
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      int4 map = records.map(number, axis);
      map.x = u_on_axis(map, tile.voxels.begin);
      memory.prepared[slot][axis] =
          make_float4(__int_as_float(map.x), __int_as_float(map.y), __int_as_float(map.z), __int_as_float(map.w));
    }
  }
}

/// A voxel whose owner has no map that may be used. Rarely called, so out of line, with everything by value.
template <class Sink>
__device__ __noinline__ bool write_slowly(const TileTask& task, const Sink& sink, unsigned number, int out,
                                          glm::ivec3 at, glm::i32vec3 signs) {
  return sink.write(out, at, fixed_offset(coarse_u(vertices_of(task.lattice, task.tetrahedron(number)), at, signs)));
}

/// Samples the columns of a tile along k, a lane each.
template <class Sink>
struct ColumnSampler {
  const IntervalTile& tile;
  const Sink& sink;

  template <bool kAllUsable>
  __device__ auto maps() const {
    return CoarseMaps<kLineQuads, kAllUsable>{tile.memory.prepared, tile.memory.usable, kNobody};
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
      return write_slowly(tile.task, sink, tile.memory.numbers[slot], out, at, tile.signs);
    });
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
