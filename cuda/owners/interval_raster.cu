// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/interval_raster.cuh"

#include <algorithm>

#include "cuda/owners/gather.cuh"
#include "cuda/owners/interval_list.cuh"
#include "cuda/owners/interval_marks.cuh"
#include "cuda/owners/interval_sample.cuh"
#include "cuda/runtime/fetch.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kIntervalBlocks = 5;  ///< a multiprocessor, where few registers do

/// Finds and samples the voxels of a box: a thread block a tile, grid as there are tiles on each axis.
///
///     take the tetrahedra that may reach it -> mark their intervals -> read the rows: are there holes, does anything
///     overlap?
///       -> if it does, mark again in order -> take their maps -> sample the columns
///
/// @param task  `counters` are added to; tiles that more tetrahedra may reach than there is room for are left
/// @param sink  gets every voxel of the tiles that are not left
template <class Sink>
__global__ void __launch_bounds__(kTileThreads, Sink::kIsWide ? kTileBlocks : kIntervalBlocks)
    tile_kernel(const __grid_constant__ TileTask task, const __grid_constant__ Sink sink) {
  __shared__ TileMemory memory;
  const glm::ivec3 at(blockIdx.x, blockIdx.y, blockIdx.z);
  const IntBox voxels = task.voxels(at);
  const int number = task.tile_number(at), thread = static_cast<int>(threadIdx.x);
  const auto [count, moving] = task.counts[number];
  if (count > kSlots) {
    if (thread == 0) atomicAdd(&task.counters->left, 1u);
    return;
  }
  const glm::ivec3 size = voxels.end - voxels.begin;
  const IntervalTile tile{task,
                          memory,
                          voxels,
                          size,
                          task.turns.signs(voxels.begin),
                          task.lists + std::int64_t{number} * kSlots,
                          static_cast<int>(count),
                          thread};
  if (count != 0 && moving == 0 && is_all_at_rest(task, voxels, thread)) {
    copy_tile(voxels, thread, sink);
    if (thread == 0) atomicAdd(&task.counters->covered, static_cast<unsigned long long>(size.x * size.y * size.z));
    return;
  }
  clear_marks(tile);
  __syncthreads();
  read_tetrahedra(tile, sink);
  __syncthreads();
  mark_all(tile);
  __syncthreads();
  read_rows(tile);
  read_maps(tile);
  __syncthreads();
  if (memory.balance != 0 || tile.has_lost_rows()) {
    __syncthreads();
    clear_marks(tile);
    __syncthreads();
    read_tetrahedra(tile, sink);
    __syncthreads();
    sort_slots(tile);
    __syncthreads();
    mark_in_order(tile);
    __syncthreads();
    read_rows(tile);
    read_maps(tile);
    __syncthreads();
  }
  const ColumnSampler<Sink> sampler{tile, sink};
  const bool is_full = memory.covered == static_cast<unsigned>(size.x * size.y * size.z);
  // `group_sum`, not CUB's sum: that saves 8 instructions, but takes 88 more in the kernel for volumes of any types.
  const unsigned covered = group_sum(is_full && !memory.is_border && !memory.is_slow ? sampler.template sample<true>()
                                                                                     : sampler.template sample<false>(),
                                     32);
  if (tile.lane() == 0 && covered != 0) atomicAdd(&task.counters->covered, static_cast<unsigned long long>(covered));
}

/// Marks the voxels of tiles that were left, for the claims: a thread block a tile, a thread a row.
///
/// @param task     `counts` are read  @param several  a bit for each voxel of the box, as `BitRows`: written by atomics
__global__ void mark_left_kernel(TileTask task, std::uint32_t* several) {
  const int number = static_cast<int>(blockIdx.x);
  if (task.counts[number].all <= kSlots) return;
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

std::int64_t tetrahedra_of(const StepLattice& lattice) {
  return std::int64_t{lattice.cells.x} * lattice.cells.y * lattice.cells.z * kTetrahedraPerCell;
}

TileTask make_task(const DeviceField& field, const SlabBox& box) {
  TileTask task{};
  task.lattice = field.steps;
  task.turns = NudgeTurns(field.frame.nudge);
  task.box = {glm::ivec3(box.begin), glm::ivec3(box.begin + box.size)};
  const glm::ivec3 size(kTileI, kTileJ, kTileK);
  for (int axis = 0; axis < 3; ++axis) {
    task.origin[axis] = static_cast<int>(
        tile_origin(task.box.begin[axis], task.box.end[axis], task.turns.first_down[axis], size[axis]));
    task.tiles[axis] = (task.box.end[axis] - task.origin[axis] + size[axis] - 1) / size[axis];
  }
  return task;
}

}  // namespace

bool IntervalRaster::suits(const StepLattice& lattice, const SlabBox& box, bool is_folded) {
  const float kLeast = (is_folded ? 5 : 8) * kStepsPerVoxel, kMost = 40 * kStepsPerVoxel;
  constexpr int kFarthest = VoxelRange::kMost - 2048;  // packed vertices move less than 2048 voxels
  constexpr std::int64_t kMostBytes = 4;               // for each voxel
  const glm::vec3& cell = lattice.cell;
  if (std::min({cell.x, cell.y, cell.z}) < kLeast || std::max({cell.x, cell.y, cell.z}) > kMost) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const float low = lattice.first[axis] * kVoxelsPerStep,
                high = low + static_cast<float>(lattice.cells[axis]) * cell[axis] * kVoxelsPerStep;
    if (low < -kFarthest || high > kFarthest || box.begin[axis] + box.size[axis] > kFarthest) return false;
  }
  return tetrahedra_of(lattice) * kRecordQuads * std::int64_t{sizeof(int4)} <= kMostBytes * box.count();
}

template <class Sink>
void IntervalRaster::run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream) {
  TileTask task = make_task(lattice.field(), box);
  counters_.fill(0, 1, stream);
  task.counters = counters_.data();
  const std::int64_t tiles = std::int64_t{task.tiles.x} * task.tiles.y * task.tiles.z,
                     count = tetrahedra_of(task.lattice);
  task.records = {records_.reserve(static_cast<std::size_t>(count * kRecordQuads)), count};
  task.lists = lists_.reserve(static_cast<std::size_t>(tiles * kSlots));
  counts_.fill(0, static_cast<std::size_t>(tiles), stream);
  task.counts = counts_.data();
  if (!has_records_) {
    record_kernel<<<blocks_for(count), kThreads, 0, stream>>>(task);
    has_records_ = true;
  }
  list_kernel<<<blocks_for(count), kThreads, 0, stream>>>(task);
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
  task.counts = counts_.data();
  mark_left_kernel<<<static_cast<unsigned>(task.tiles.x * task.tiles.y * task.tiles.z), kTileRows, 0, stream>>>(
      task, several);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

#define TETWARP_RUN(...) \
  template void IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const __VA_ARGS__&, cudaStream_t)
TETWARP_FOR_EACH_SINK(TETWARP_RUN, Lerp::fused);
#undef TETWARP_RUN

}  // namespace tetwarp::cuda_detail
