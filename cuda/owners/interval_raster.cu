// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/interval_raster.cuh"

#include <algorithm>

#include "cuda/owners/gather.cuh"
#include "cuda/owners/interval_cells.cuh"
#include "cuda/owners/interval_list.cuh"
#include "cuda/owners/interval_marks.cuh"
#include "cuda/owners/interval_sample.cuh"
#include "cuda/runtime/fetch.h"

namespace tetwarp::cuda_detail {

namespace {

/// Finds and samples the voxels of a box: a thread block a tile, grid as there are tiles on each axis.
///
///     list the tetrahedra that may reach it -> mark their intervals, again in order where they overlap
///       -> mark holes -> map the tetrahedra -> sample the columns
///
/// @param task  `cells` are read, and `left` of a tile is written where more tetrahedra may reach it than there is room
///              for; `counters` are added to
/// @param sink  gets every voxel of the tiles that are not left
template <class Sink>
__global__ void __launch_bounds__(kTileThreads, kTileBlocks)
    tile_kernel(const __grid_constant__ TileTask task, const __grid_constant__ Sink sink) {
  __shared__ TileMemory memory;
  const glm::ivec3 at(blockIdx.x, blockIdx.y, blockIdx.z);
  const IntBox voxels = task.voxels(at);
  TileCells& cells = task.cells[task.tile_number(at)];
  const int thread = static_cast<int>(threadIdx.x);
  const glm::ivec3 size = voxels.end - voxels.begin;
  const IntervalTile tile{task,
                          memory,
                          voxels,
                          size,
                          task.turns.signs(voxels.begin),
                          cells.first,
                          cells.size,
                          thread,
                          IntervalTile::has_room(cells.size)};
  if (cells.rests) {
    copy_tile(voxels, thread, sink);
    if (thread == 0) atomicAdd(&task.counters->covered, static_cast<unsigned long long>(size.x * size.y * size.z));
    return;
  }
  if (cells.left) {
    if (thread == 0) atomicAdd(&task.counters->left, 1u);
    return;
  }
  if (thread == 0) memory.settled = 0;
  clear_marks(tile);
  if (tile.at_hand) tile.read_vertices();
  __syncthreads();
  if (!list_tetrahedra(tile)) {
    if (thread == 0) {
      cells.left = 1;
      atomicAdd(&task.counters->left, 1u);
    }
    return;
  }
#pragma unroll 1
  for (int n = 0; n < 2; ++n) {
    rasterise(tile, n != 0);
    if (!memory.overlaps) break;
    __syncthreads();
    clear_marks(tile);
  }
  mark_holes(tile);
  map_tetrahedra(tile);
  __syncthreads();
  const ColumnSampler<Sink> sampler{tile, sink};
  const bool inside = sink.surrounds(cells.source_begin, cells.source_end);
  // `group_sum`, not CUB's sum: that saves 8 instructions, but takes 88 more in the kernel for volumes of any types.
  const unsigned covered = group_sum(inside ? sampler.template sample<true>() : sampler.template sample<false>(), 32);
  if (tile.lane() == 0) atomicAdd(&memory.settled, covered);
  __syncthreads();
  if (thread == 0 && memory.settled != 0)
    atomicAdd(&task.counters->covered, static_cast<unsigned long long>(memory.settled));
}

/// Marks the voxels of tiles that were left, for the claims: a thread block a tile, a thread a row.
///
/// @param task     `cells` are read  @param several  a bit for each voxel of the box, as `BitRows`: written by atomics
__global__ void mark_left_kernel(TileTask task, std::uint32_t* several) {
  const int number = static_cast<int>(blockIdx.x);
  if (!task.cells[number].left) return;
  const IntBox voxels = task.voxels(position_in(number, task.tiles));
  const glm::ivec3 size = voxels.end - voxels.begin, of_box = task.box.end - task.box.begin;
  const int y = static_cast<int>(threadIdx.x) % kTileJ, z = static_cast<int>(threadIdx.x) / kTileJ;
  if (y >= size.y || z >= size.z) return;
  const glm::ivec3 first = voxels.begin - task.box.begin;
  const std::int64_t row = (std::int64_t{first.z + z} * of_box.y + first.y + y) * ((of_box.x + 31) / 32);
  const int last = first.x + size.x - 1;
  for (int word = first.x / 32; word <= last / 32; ++word)
    atomicOr(&several[row + word], bits_of_word(word, first.x, last));
}

TileTask make_task(const DeviceField& field, const SlabBox& box) {
  TileTask task{};
  task.lattice = field.steps;
  task.turns = NudgeTurns(field.frame.nudge);
  task.box = {glm::ivec3(box.begin), glm::ivec3(box.begin + box.size)};
  task.blocks = (field.steps.cells + kBlockCells - 1) / kBlockCells;
  const glm::ivec3 size(kTileI, kTileJ, kTileK);
  for (int axis = 0; axis < 3; ++axis) {
    task.origin[axis] = static_cast<int>(
        tile_origin(task.box.begin[axis], task.box.end[axis], task.turns.first_down[axis], size[axis]));
    task.tiles[axis] = (task.box.end[axis] - task.origin[axis] + size[axis] - 1) / size[axis];
  }
  return task;
}

}  // namespace

bool IntervalRaster::suits(const StepLattice& lattice, bool is_folded) {
  const float kLeast = (is_folded ? 5 : 8) * kStepsPerVoxel, kMost = 40 * kStepsPerVoxel;
  const glm::vec3& cell = lattice.cell;
  return std::min({cell.x, cell.y, cell.z}) >= kLeast && std::max({cell.x, cell.y, cell.z}) <= kMost;
}

template <class Sink>
void IntervalRaster::run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream) {
  TileTask task = make_task(lattice.field(), box);
  counters_.fill(0, 1, stream);
  const std::int64_t blocks = std::int64_t{task.blocks.x} * task.blocks.y * task.blocks.z,
                     tiles = std::int64_t{task.tiles.x} * task.tiles.y * task.tiles.z;
  task.moves = moves_.reserve(static_cast<std::size_t>(blocks + 1));
  task.cells = cells_.reserve(static_cast<std::size_t>(tiles));
  task.counters = counters_.data();
  if (!has_moves_) {
    moves_.fill(0, 1, stream);  // the least box that holds no move at all: it only grows
    moves_kernel<<<blocks_for(blocks * 32), kThreads, 0, stream>>>(task);
    has_moves_ = true;
  }
  cells_kernel<<<blocks_for(tiles * 32), kThreads, 0, stream>>>(task);
  const dim3 grid(static_cast<unsigned>(task.tiles.x), static_cast<unsigned>(task.tiles.y),
                  static_cast<unsigned>(task.tiles.z));
  tile_kernel<<<grid, kTileThreads, 0, stream>>>(task, sink);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

IntervalRaster::Counters IntervalRaster::counters(cudaStream_t stream) {
  return fetch(counters_.data(), found_, stream);
}

void IntervalRaster::mark_left(const LatticeOnDevice& lattice, const SlabBox& box, std::uint32_t* several,
                               cudaStream_t stream) const {
  TileTask task = make_task(lattice.field(), box);
  task.cells = cells_.data();
  mark_left_kernel<<<static_cast<unsigned>(task.tiles.x * task.tiles.y * task.tiles.z), kTileRows, 0, stream>>>(
      task, several);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

#define TETWARP_RUN(...) \
  template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const __VA_ARGS__&, cudaStream_t)
TETWARP_FOR_EACH_SINK(TETWARP_RUN, Lerp::fused);
#undef TETWARP_RUN

}  // namespace tetwarp::cuda_detail
