// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/gather.cuh"
#include "cuda/owners/interval_marks.cuh"
#include "cuda/owners/interval_sample.cuh"

/// The kernel of a tile of a coarse field, for lattices (interval_raster.cu) and meshes (mesh_raster.cu).
namespace tetwarp::cuda_detail {

namespace {

constexpr int kIntervalBlocks = 5;  ///< a multiprocessor, where few registers do

/// Finds and samples the voxels of a box: a thread block a tile, grid as there are tiles that reach it on each axis.
///
///     take the tetrahedra that may reach it -> mark their intervals -> read the rows, for holes and overlaps
///       -> where there are overlaps, mark again in order -> take their maps -> sample the columns
///
/// @param task  `counters` are added to; tiles that more tetrahedra may reach than there is room for are left
/// @param sink  gets every voxel of the tiles that are not left
template <class Shape, class Sink>
__global__ void __launch_bounds__(kTileThreads, Sink::kIsWide ? kTileBlocks : kIntervalBlocks)
    tile_kernel(const __grid_constant__ TileTask<Shape> task, const __grid_constant__ Sink sink) {
  using Memory = TileMemory<Shape::kDepth>;
  __shared__ Memory memory;
  const glm::ivec3 at = task.first_tile + glm::ivec3(blockIdx.x, blockIdx.y, blockIdx.z);
  const IntBox voxels = task.voxels(at);
  const int number = task.tile_number(at), thread = static_cast<int>(threadIdx.x);
  if (!task.kept.is_wanted(number)) {  // first, for most tiles may not be; then none is of another depth
    if (thread == 0 && !voxels.is_empty())
      atomicAdd(&task.counters->covered, static_cast<unsigned long long>(task.kept.covered[number]));
    return;
  }
  const TileList list = task.shape.list(at, number);
  if (list.is_done || voxels.is_empty()) return;
  if (list.count > Memory::kSlots) {
    if (thread == 0) atomicAdd(&task.counters->left, 1u);
    return;
  }
  const glm::ivec3 size = voxels.end - voxels.begin;
  if constexpr (!kIsOfOwners<Sink>) {
    if (list.may_rest && task.shape.rests(voxels, task.records, thread)) {
      copy_tile(voxels, thread, sink);
      if (thread == 0) task.add_covered(number, static_cast<unsigned>(size.x * size.y * size.z));
      return;
    }
  }
  const IntervalTile<Shape> tile{
      task, memory, voxels, size, task.turns.signs(voxels.begin), list.numbers, static_cast<int>(list.count), thread};
  clear_marks(tile);
  __syncthreads();
  read_tetrahedra(tile);
  __syncthreads();
  mark_all(tile);
  __syncthreads();
  read_rows(tile);
  if constexpr (!kIsOfOwners<Sink>) read_maps(tile, sink);
  __syncthreads();
  if (memory.covered != memory.marked || tile.has_lost_rows()) {
    __syncthreads();
    clear_marks(tile);
    __syncthreads();
    read_tetrahedra(tile);
    __syncthreads();
    sort_slots(tile);
    __syncthreads();
    mark_in_order(tile);
    __syncthreads();
    read_rows(tile);
    if constexpr (!kIsOfOwners<Sink>) read_maps(tile, sink);
    __syncthreads();
  }
  if constexpr (kIsOfOwners<Sink>) {
    write_owners(tile, sink);
    if (thread == 0) task.add_covered(number, memory.covered);
    return;
  } else {
    const ColumnSampler<Shape, Sink> sampler{tile, sink};
    const bool is_full = memory.covered == static_cast<unsigned>(size.x * size.y * size.z);
    // `group_sum`, not CUB's sum: that saves 8 instructions, but takes 88 more in the kernel for volumes of any types.
    const unsigned covered =
        group_sum(is_full && !memory.is_border && !memory.is_slow ? sampler.template sample<true>()
                                                                  : sampler.template sample<false>(),
                  32);
    if (tile.lane() == 0 && covered != 0) task.add_covered(number, covered);
  }
}

}  // namespace

}  // namespace tetwarp::cuda_detail
