// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/mesh_raster.cuh"

#include <cub/device/device_reduce.cuh>
#include <cub/device/device_scan.cuh>

#include "cuda/owners/gather.cuh"
#include "cuda/owners/interval_kernel.cuh"
#include "cuda/owners/mesh_sample.cuh"
#include "cuda/runtime/fetch.h"

namespace tetwarp::cuda_detail {

namespace {

template <class Sink>
constexpr bool is_wide() {
  if constexpr (requires { Sink::kIsWide; }) return Sink::kIsWide;
  return false;
}
template <class Sink>
constexpr bool is_coarse() {
  if constexpr (requires { Sink::kLerp; }) return Sink::kLerp == Lerp::fused;
  return false;
}

/// The tetrahedra of a mesh as tiles of interval_kernel.cuh see them.
struct MeshShape {
  static constexpr int kDepth = kTileK;

  MeshRaster::View mesh;
  const unsigned long long* first;  ///< of each tile, i fastest, and of one more: where its list begins
  const unsigned* numbers;          ///< the lists

  __device__ Tetrahedron tetrahedron(unsigned number) const { return mesh.tetrahedron(number); }
  __device__ TileList list(const glm::ivec3&, int tile) const {
    return {numbers + first[tile], first[tile + 1] - first[tile], false, false};
  }
  __device__ static bool rests(const IntBox&, const Records&, int) { return false; }
};

/// Finds the owners of the voxels of a box, and gives them to a sink: a thread block a tile that the box reaches.
///
///     a list that fits the slots: sort it, mark slots, weigh them, sample from shared memory
///     a longer one: mark numbers, as many tetrahedra at a time as there are slots; sample from global memory
///
/// @param task        the lists are read  @param box  half open, voxels of the output
/// @param first_tile  that the box reaches, on each axis  @param sink  gets every voxel of the box
/// @param done        tiles with lists up to that length are left alone
/// @param covered     how many voxels of a sink that samples are covered: added to
template <bool kCountsOwners, class Sink>
__global__ void __launch_bounds__(kTileThreads, is_wide<Sink>() ? kTileBlocks : kTileBlocks + 1)
    mesh_tile_kernel(const __grid_constant__ MeshTask task, const __grid_constant__ IntBox box,
                     const __grid_constant__ glm::ivec3 first_tile, const __grid_constant__ Sink sink, int done,
                     unsigned long long* covered) {
  __shared__ MeshTileMemory<kCountsOwners> memory;
  const glm::ivec3 at = first_tile + glm::ivec3(blockIdx.x, blockIdx.y, blockIdx.z);
  const int number = task.number_of(at);
  const unsigned long long first = task.first[number], count = task.first[number + 1] - first;
  if (static_cast<long long>(count) <= done) return;
  IntBox voxels = task.voxels(at);
  voxels = {glm::max(voxels.begin, box.begin), glm::min(voxels.end, box.end)};
  const glm::i64vec3 first_voxel(voxels.begin);
  const MeshTile<kCountsOwners> tile{task,
                                     memory,
                                     voxels,
                                     voxels.end - voxels.begin,
                                     task.mesh.nudge.signs(first_voxel),
                                     static_cast<int>(threadIdx.x)};
  tile.clear();
  const bool is_few = !is_coarse<Sink>() && count <= kMeshSlots;
  if (is_few) {
    tile.rasterise_few(task.numbers + first, static_cast<int>(count));
  } else {
    tile.rasterise_many(task.numbers + first, count);
  }
  const MeshSampler<kCountsOwners> sampler{tile};
  const unsigned found = group_sum(sampler.finish(sink, is_few), 32);  // as at the end of `tile_kernel`
  if (tile.lane() == 0) atomicAdd(&memory.covered, found);
  __syncthreads();
  if (tile.thread == 0 && memory.covered != 0) atomicAdd(covered, static_cast<unsigned long long>(memory.covered));
}

}  // namespace

std::uint64_t MeshRaster::bytes_of(const SnappedMesh& mesh) {
  return mesh.vertices.size() * sizeof(Vertex) + mesh.tetrahedra.size() * sizeof(glm::u32vec4);
}

std::uint64_t MeshRaster::held_bytes() const {
  return vertices_.capacity() * sizeof(Vertex) + tetrahedra_.capacity() * sizeof(glm::u32vec4) +
         numbers_.capacity() * sizeof(unsigned) + records_.capacity() * sizeof(int4);
}

void MeshRaster::set(const SnappedMesh& mesh, const Geometry& output, cudaStream_t stream) {
  vertices_.upload(mesh.vertices.data(), mesh.vertices.size(), stream);
  tetrahedra_.upload(mesh.tetrahedra.data(), mesh.tetrahedra.size(), stream);
  count_ = static_cast<unsigned>(mesh.tetrahedra.size());
  nudge_ = mesh.nudge;
  size_ = glm::ivec3(output.size);
  const glm::ivec3 extent(kTileI, kTileJ, kTileK);
  for (int axis = 0; axis < 3; ++axis) {
    origin_[axis] = static_cast<int>(tile_origin(0, output.size[axis], mesh.nudge.first_down(axis), extent[axis]));
    tiles_[axis] = (size_[axis] - origin_[axis] + extent[axis] - 1) / extent[axis];
  }
  const auto tiles =
      static_cast<std::size_t>(tiles_.x) * static_cast<std::size_t>(tiles_.y) * static_cast<std::size_t>(tiles_.z);
  first_.fill(0, tiles + 1, stream);
  next_.fill(0, tiles, stream);
  MeshTask task{view(), count_, size_, origin_, tiles_, first_.data(), next_.data(), nullptr};
  const unsigned blocks = blocks_for(std::int64_t{count_} * 32);
  mesh_list_kernel<true><<<blocks, kThreads, 0, stream>>>(task);
  std::size_t bytes = 0;
  const auto with_room = [&](auto&& work) {  // first it tells how much, then it is given
    work(nullptr);
    work(scan_.reserve(bytes));
  };
  unsigned long long* longest = longest_.reserve(1);
  with_room([&](void* memory) {
    TETWARP_CUDA_TRY(
        cub::DeviceReduce::Max(memory, bytes, first_.data(), longest, static_cast<std::int64_t>(tiles), stream));
  });
  with_room([&](void* memory) {
    TETWARP_CUDA_TRY(cub::DeviceScan::ExclusiveSum(memory, bytes, first_.data(), first_.data(),
                                                   static_cast<std::int64_t>(tiles + 1), stream));
  });
  unsigned long long pairs = 0, most = 0;
  TETWARP_CUDA_TRY(cudaMemcpyAsync(&pairs, first_.data() + tiles, sizeof pairs, cudaMemcpyDeviceToHost, stream));
  TETWARP_CUDA_TRY(cudaMemcpyAsync(&most, longest, sizeof most, cudaMemcpyDeviceToHost, stream));
  TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  has_long_lists_ = most > slots_of(kTileK);
  task.numbers = numbers_.reserve(std::max<std::size_t>(pairs, 1));
  mesh_list_kernel<false><<<blocks, kThreads, 0, stream>>>(task);
  const std::int64_t voxels = std::int64_t{size_.x} * size_.y * size_.z;
  has_records_ =
      mesh.coarse && Records::suit(count_, voxels) && std::max({size_.x, size_.y, size_.z}) <= VoxelRange::kMost;
  if (has_records_) {
    const Records records{records_.reserve(std::size_t{count_} * kRecordQuads), count_};
    record_kernel<<<blocks_for(std::int64_t{count_}), kThreads, 0, stream>>>(
        MeshShape{view(), first_.data(), numbers_.data()}, records);
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

template <class Sink>
void MeshRaster::run(const SlabBox& box, const Sink& sink, cudaStream_t stream) {
  const IntBox in{glm::ivec3(box.begin), glm::ivec3(box.begin + box.size)};
  const glm::ivec3 extent(kTileI, kTileJ, kTileK), first = (in.begin - origin_) / extent,
                                                   tiles = (in.end - 1 - origin_) / extent - first + 1;
  const dim3 grid(static_cast<unsigned>(tiles.x), static_cast<unsigned>(tiles.y), static_cast<unsigned>(tiles.z));
  counters_.fill(0, 1, stream);
  int done = -1;
  if constexpr (is_coarse<Sink>()) {
    if (has_records_) {
      const TileTask<MeshShape> task{{view(), first_.data(), numbers_.data()},
                                     NudgeTurns(nudge_),
                                     in,
                                     origin_,
                                     tiles_,
                                     first,
                                     {records_.data(), count_},
                                     counters_.data()};
      tile_kernel<<<grid, kTileThreads, 0, stream>>>(task, sink);
      TETWARP_CUDA_TRY(cudaGetLastError());
      if (!has_long_lists_) return;
      done = slots_of(kTileK);
    }
  }
  const MeshTask task{view(), count_, size_, origin_, tiles_, first_.data(), next_.data(), numbers_.data()};
  const auto launch = [&](auto counts) {
    mesh_tile_kernel<decltype(counts)::value>
        <<<grid, kTileThreads, 0, stream>>>(task, in, first, sink, done, &counters_.data()->covered);
  };
  if constexpr (std::is_same_v<Sink, OwnerSink>) {
    if (sink.several) {
      launch(std::true_type{});
    } else {
      launch(std::false_type{});
    }
  } else {
    launch(std::false_type{});
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

std::uint64_t MeshRaster::covered(cudaStream_t stream) { return fetch(counters_.data(), found_, stream).covered; }

template void MeshRaster::run(const SlabBox&, const OwnerSink&, cudaStream_t);
template void MeshRaster::run(const SlabBox&, const HoleSink&, cudaStream_t);
#define TETWARP_RUN(...) template void MeshRaster::run(const SlabBox&, const __VA_ARGS__&, cudaStream_t)
TETWARP_FOR_EACH_SINK(TETWARP_RUN, Lerp::separate);
TETWARP_FOR_EACH_SINK(TETWARP_RUN, Lerp::fused);
#undef TETWARP_RUN

}  // namespace tetwarp::cuda_detail
