// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/interval_raster.cuh"

#include <algorithm>

#include "cuda/owners/interval_kernel.cuh"
#include "cuda/owners/interval_list.cuh"
#include "cuda/runtime/fetch.h"
#include "deform/update/tile_regions.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kFlat = kTileK / 2;  ///< depth of tiles for small cells

/// Marks the voxels of tiles that were left, for the claims: a thread block a tile, a thread a row.
///
/// @param task     its counts are read
/// @param several  a bit for each voxel of the box, as `BitRows`: written by atomics
template <class Shape>
__global__ void mark_left_kernel(const __grid_constant__ TileTask<Shape> task, std::uint32_t* several) {
  const int number = static_cast<int>(blockIdx.x);
  const glm::ivec3 at = position_in(number, task.tiles);
  if (task.shape.counts[number].all <= Shape::kSlots || task.shape.is_done(at)) return;
  const IntBox voxels = task.voxels(at);
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
std::int64_t count_of(const glm::ivec3& tiles) { return std::int64_t{tiles.x} * tiles.y * tiles.z; }
/// Cells for which tiles of full depth have room.
bool is_for_deep(const StepLattice& lattice) {
  return std::min({lattice.cell.x, lattice.cell.y, lattice.cell.z}) >= 7 * kStepsPerVoxel;
}

}  // namespace

bool IntervalRaster::suits(const StepLattice& lattice, const SlabBox& box, bool is_folded) {
  const float kLeast = (is_folded ? 5 : 6) * kStepsPerVoxel, kMost = 40 * kStepsPerVoxel;
  constexpr int kFarthest = VoxelRange::kMost - 2048;  // packed vertices move less than 2048 voxels
  const glm::vec3& cell = lattice.cell;
  if (std::min({cell.x, cell.y, cell.z}) < kLeast || std::max({cell.x, cell.y, cell.z}) > kMost) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const float low = lattice.first[axis] * kVoxelsPerStep,
                high = low + static_cast<float>(lattice.cells[axis]) * cell[axis] * kVoxelsPerStep;
    if (low < -kFarthest || high > kFarthest || box.begin[axis] + box.size[axis] > kFarthest) return false;
  }
  return Records::suit(tetrahedra_of(lattice), box.count());
}

template <int kDepth>
auto IntervalRaster::make_task(const LatticeOnDevice& lattice, const SlabBox& box) {
  const DeviceField& field = lattice.field();
  TileTask<LatticeShape<kDepth>> task{};
  task.turns = NudgeTurns(field.frame.nudge);
  task.box = {glm::ivec3(box.begin), glm::ivec3(box.begin + box.size)};
  const glm::ivec3 size(kTileI, kTileJ, kDepth);
  for (int axis = 0; axis < 3; ++axis) {  // flat tiles are halves of deep ones
    const int origin = static_cast<int>(tile_origin(task.box.begin[axis], task.box.end[axis],
                                                    task.turns.first_down[axis], axis == 2 ? kTileK : size[axis]));
    task.origin[axis] = origin;
    task.tiles[axis] = (task.box.end[axis] - origin + size[axis] - 1) / size[axis];
  }
  const auto tetrahedra = static_cast<std::size_t>(tetrahedra_of(field.steps)),
             tiles = static_cast<std::size_t>(count_of(task.tiles));
  task.records = {records_.reserve(tetrahedra * kRecordQuads), static_cast<std::int64_t>(tetrahedra)};
  task.counters = counters_.reserve(1);
  Tiles& held = kDepth == kTileK ? deep_ : flat_;
  task.shape = {field.steps, held.counts.reserve(tiles), held.lists.reserve(tiles * slots_of(kDepth)), nullptr,
                glm::ivec3(0)};
  if (kDepth == kFlat && tried_deep_) {
    task.shape.deep = deep_.counts.data();
    task.shape.deep_tiles = {task.tiles.x, task.tiles.y, (task.tiles.z + 1) / 2};
  }
  return task;
}

bool IntervalRaster::has_kept(int depth, const StepLattice& lattice, const SlabBox& box) const {
  return kept_depth_ == depth && kept_lattice_.cells == lattice.cells && kept_lattice_.first == lattice.first &&
         kept_lattice_.cell == lattice.cell && kept_box_.begin == box.begin && kept_box_.size == box.size;
}

void IntervalRaster::keep(int depth, const StepLattice& lattice, const SlabBox& box, cudaStream_t stream) {
  const auto vertices = static_cast<std::size_t>(lattice.slice) * static_cast<std::size_t>(lattice.cells.z + 1);
  std::uint64_t* const to = kept_vertices_.reserve(vertices);
  TETWARP_CUDA_TRY(
      cudaMemcpyAsync(to, lattice.packed, vertices * sizeof(std::uint64_t), cudaMemcpyDeviceToDevice, stream));
  kept_lattice_ = lattice;
  kept_lattice_.packed = to;
  kept_box_ = box;
  kept_depth_ = depth;
}

template <int kDepth, class Sink>
TileCounters IntervalRaster::run_tiles(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink,
                                       cudaStream_t stream, const TileReuse& wanted) {
  const auto [reuse, seen] = wanted;
  auto task = make_task<kDepth>(lattice, box);
  Tiles& held = kDepth == kTileK ? deep_ : flat_;
  const auto tiles = static_cast<std::size_t>(count_of(task.tiles));
  const StepLattice& steps = lattice.field().steps;
  const bool only_changed =
      reuse == Reuse::now && !has_records_ && has_kept(kDepth, steps, box) && (!seen || has_content_);
  kept_depth_ = 0;
  held.counts.fill(0, tiles, stream);
  counters_.fill(0, 1, stream);
  has_content_ = seen && reuse != Reuse::nothing;
  if (reuse != Reuse::nothing) task.kept.covered = kept_covered_.reserve(tiles);
  if (has_content_) {
    task.kept.cells = cells_.reserve(static_cast<std::size_t>(steps.cells.x) * steps.cells.y * steps.cells.z);
    task.kept.content = content_.reserve(tiles);
  }
  const unsigned blocks = blocks_for(task.records.count);
  if (only_changed) {
    changed_.fill(0, tiles, stream);
    task.kept.changed = changed_.data();
    change_kernel<<<blocks, kThreads, 0, stream>>>(task, {kept_lattice_.packed, kept_lattice_.packing},
                                                   changed_.data());
    choose_kernel<<<blocks_for(static_cast<std::int64_t>(tiles)), kThreads, 0, stream>>>(
        task.kept, static_cast<int>(tiles), seen ? SeenRanges::of(seen->values) : SeenRanges{}, changed_.data(),
        stale_.data());
  } else {
    if (task.kept.covered) {
      kept_covered_.fill(0, tiles, stream);
      stale_.fill(0, tiles, stream);
    }
    if (!has_records_) record_kernel<<<blocks, kThreads, 0, stream>>>(task.shape, task.records);
    if (has_content_) {
      find_content(steps, *seen, cells_.data(), stream);
      const std::vector<ValueHull> nobody(tiles, seen->nobody());
      content_.upload(nobody.data(), tiles, stream);
      content_kernel<<<blocks, kThreads, 0, stream>>>(task);
    }
  }
  has_records_ = true;
  list_kernel<<<blocks, kThreads, 0, stream>>>(task);
  const dim3 grid(static_cast<unsigned>(task.tiles.x), static_cast<unsigned>(task.tiles.y),
                  static_cast<unsigned>(task.tiles.z));
  tile_kernel<<<grid, kTileThreads, 0, stream>>>(task, sink);
  TETWARP_CUDA_TRY(cudaGetLastError());
  if (reuse != Reuse::nothing) keep(kDepth, steps, box, stream);
  if (only_changed) {
    TETWARP_CUDA_TRY(
        cudaMemcpyAsync(changed_on_host_.reserve(tiles), changed_.data(), tiles, cudaMemcpyDeviceToHost, stream));
  }
  const TileCounters found = fetch(counters_.data(), found_, stream);
  made_.reset();
  if (found.left != 0) {
    kept_depth_ = 0;
  } else if (only_changed) {
    made_ = regions_of_tiles({changed_on_host_.reserve(tiles), tiles}, task.tiles, {kTileI, kTileJ, kDepth},
                             task.origin, {box.begin, box.begin + box.size});
  }
  return found;
}

template <class Sink>
TileCounters IntervalRaster::run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink,
                                 cudaStream_t stream, const TileReuse& reuse) {
  tried_deep_ = false;
  TileCounters found{};
  if (is_for_deep(lattice.field().steps)) {
    found = run_tiles<kTileK>(lattice, box, sink, stream, reuse);
    tried_deep_ = true;
    if (found.left == 0) return found;
  }
  const TileCounters more = run_tiles<kFlat>(lattice, box, sink, stream, tried_deep_ ? TileReuse{} : reuse);
  return {found.covered + more.covered, more.left};
}

void IntervalRaster::mark_left(const LatticeOnDevice& lattice, const SlabBox& box, std::uint32_t* several,
                               cudaStream_t stream) {
  const auto task = make_task<kFlat>(lattice, box);
  mark_left_kernel<<<static_cast<unsigned>(count_of(task.tiles)), kTileJ * kFlat, 0, stream>>>(task, several);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

#define TETWARP_RUN(...)                                                                                              \
  template TileCounters IntervalRaster::run(const LatticeOnDevice&, const SlabBox&, const __VA_ARGS__&, cudaStream_t, \
                                            const TileReuse&)
TETWARP_FOR_EACH_SINK(TETWARP_RUN, Lerp::fused);
TETWARP_RUN(OwnerSink);
#undef TETWARP_RUN

}  // namespace tetwarp::cuda_detail
