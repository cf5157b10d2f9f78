// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/mesh_raster.cuh"

#include <cub/device/device_scan.cuh>

#include "cuda/output/voxel_sink.cuh"
#include "cuda/output/weighing.cuh"
#include "cuda/owners/gather.cuh"
#include "cuda/runtime/warp.cuh"
#include "deform/core/row_interval.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kTileI = 32, kTileJ = 8, kTileK = 16;  ///< voxels of a tile
constexpr int kTileRows = kTileJ * kTileK;
constexpr int kTileThreads = 32 * kTileJ;  ///< a warp a column of rows
constexpr int kTileBlocks = 4;             ///< a multiprocessor
constexpr int kSlots = 112;                ///< tetrahedra whose arithmetic is prepared at a time
constexpr int kRowStride = kTileI + 1;     ///< so that a column of rows lies in different banks
static_assert(kTileI <= kMostRowTile && kTileJ <= kMostRowTile && kTileK <= kMostRowTile);

/// What all kernels know.
struct MeshTask {
  MeshRaster::View mesh;
  unsigned count;            ///< tetrahedra
  glm::ivec3 size;           ///< of the output
  glm::ivec3 origin, tiles;  ///< first voxel of the first tile; how many on each axis
  unsigned long long* first;
  unsigned* next;
  unsigned* numbers;

  /// The voxels of a tile that the output has.
  __device__ IntBox voxels(const glm::ivec3& tile) const {
    const glm::ivec3 extent(kTileI, kTileJ, kTileK), begin = origin + tile * extent;
    return {glm::max(begin, glm::ivec3(0)), glm::min(begin + extent, size)};
  }
  __device__ int number_of(const glm::ivec3& tile) const { return (tile.z * tiles.y + tile.y) * tiles.x + tile.x; }
};

/// One warp a tetrahedron: counts it for every tile that it may reach, or writes its number to their lists.
template <bool kCounts>
__global__ void list_kernel(MeshTask task) {
  const std::int64_t number = (std::int64_t{blockIdx.x} * kThreads + threadIdx.x) / 32;
  if (number >= task.count) return;
  const Tetrahedron t = task.mesh.tetrahedron(static_cast<unsigned>(number));
  const VoxelBox reached = detail::candidates(task.mesh.nudge, box_of(t), {glm::i64vec3(0), glm::i64vec3(task.size)});
  if (detail::is_empty(reached)) return;
  const glm::ivec3 extent(kTileI, kTileJ, kTileK),
      begin = (glm::ivec3(reached.begin) - task.origin) / extent,
      size = (glm::ivec3(reached.end) - 1 - task.origin) / extent - begin + 1;
  const TetrahedronPlanes planes(t);
  const std::int64_t tiles = std::int64_t{size.x} * size.y * size.z;
  for (std::int64_t n = threadIdx.x & 31; n < tiles; n += 32) {
    const glm::ivec3 tile = begin + glm::ivec3(unravel(n, glm::i64vec3(size)));
    const IntBox box = task.voxels(tile);
    if (tiles > 1 && !planes.may_reach({glm::i64vec3(box.begin), glm::i64vec3(box.end)})) continue;
    const int place = task.number_of(tile);
    if constexpr (kCounts) {
      atomicAdd(&task.first[place], 1ULL);
    } else {
      task.numbers[task.first[place] + atomicAdd(&task.next[place], 1u)] = static_cast<unsigned>(number);
    }
  }
}

/// The shared memory of a tile.
template <bool kCountsOwners>
struct TileMemory {
  /// A tetrahedron of the list, and the rows that it may reach.
  struct Slot {
    unsigned number;
    short y_begin, y_end, z_begin, z_end;
    short lower;  ///< of `RowFaces`; 0: exact integers must say
  };
  float4 prepared[kSlots + 1][kQuads];  ///< faces, and then `Weighing`, the last nobody's
  float ends[kSlots + 1];               ///< the last float of each `Weighing`
  Slot slots[kSlots];
  unsigned numbers[kSlots];                ///< before they are sorted
  unsigned owner[kTileRows * kRowStride];  ///< slot where all have one, else number; or kNoTetrahedron
  unsigned several[kCountsOwners ? kTileRows * kRowStride : 1];
  unsigned covered;

  /// Where a row begins.
  __device__ static int row(int y, int z) { return (z * kTileJ + y) * kRowStride; }
};

/// Rarely called, so out of line, with everything by value.
__device__ __noinline__ RowInterval exactly(MeshRaster::View mesh, unsigned number, glm::ivec3 first,
                                            glm::i32vec3 signs, int y, int z, int count) {
  return exact_row(mesh.tetrahedron(number), first, signs, y, z, count);
}
__device__ __noinline__ glm::vec3 interpolate_exactly(MeshRaster::View mesh, unsigned number, glm::i32vec3 steps,
                                                      glm::i32vec3 signs) {
  return interpolate_u_exactly(mesh.tetrahedron(number), steps, signs);
}
template <class Sink>
__device__ __noinline__ bool write_slowly(const MeshRaster::View& mesh, const Sink& sink, unsigned number, int out,
                                          glm::ivec3 at, glm::i32vec3 signs) {
  return sink.write(out, at, interpolate_u(mesh.tetrahedron(number), at * kStepsPerVoxel, signs));
}

/// A thread block at work on a tile, or the part of it that a box has.
template <bool kCountsOwners>
struct TileWorker {
  using Memory = TileMemory<kCountsOwners>;

  const MeshTask& task;
  Memory& memory;
  IntBox voxels;
  glm::ivec3 size;
  glm::i32vec3 signs;
  int thread;

  __device__ void clear() const {
    for (int n = thread; n < kTileRows * kRowStride; n += kTileThreads) {
      memory.owner[n] = kNoTetrahedron;
      if constexpr (kCountsOwners) memory.several[n] = 0;
    }
    if (thread != 0) return;
    memory.prepared[kSlots][0] = make_float4(0, 0, 0, kNoNumber);
    memory.covered = 0;
  }

  __device__ void prepare(int slot, unsigned number) const {
    const Tetrahedron t = task.mesh.tetrahedron(number);
    const VoxelBox reached =
        detail::candidates(task.mesh.nudge, box_of(t), {glm::i64vec3(voxels.begin), glm::i64vec3(voxels.end)});
    typename Memory::Slot& to = memory.slots[slot];
    to = {number, 0, 0, 0, 0, 0};
    if (detail::is_empty(reached)) return;
    to.y_begin = static_cast<short>(reached.begin.y - voxels.begin.y);
    to.y_end = static_cast<short>(reached.end.y - voxels.begin.y);
    to.z_begin = static_cast<short>(reached.begin.z - voxels.begin.z);
    to.z_end = static_cast<short>(reached.end.z - voxels.begin.z);
    RowFaces faces;
    if (!make_row_faces(t, voxels.begin, signs, size, faces)) return;
    to.lower = static_cast<short>(faces.lower);
    for (int n = 0; n < 4; ++n) {
      const RowFace& face = faces.faces[n];
      memory.prepared[slot][n] = make_float4(face.at, face.along_y, face.along_z, face.error);
    }
  }

  __device__ RowFaces faces_of(int slot) const {
    RowFaces t;
#pragma unroll
    for (int n = 0; n < 4; ++n) {
      const float4 face = memory.prepared[slot][n];
      t.faces[n] = {face.x, face.y, face.z, face.w};
    }
    t.lower = memory.slots[slot].lower;
    return t;
  }

  /// @param owner  to be the voxels' owner, where it is the lowest
  __device__ void mark(int slot, int y, int z, unsigned owner) const {
    const auto& of = memory.slots[slot];
    if (y < of.y_begin || y >= of.y_end || z < of.z_begin || z >= of.z_end) return;
    bool is_certain = false;
    RowInterval in{0, 0};
    if (of.lower != 0) in = RowsAlongZ(faces_of(slot), y).interval(z, size.x, is_certain);
    if (!is_certain) in = exactly(task.mesh, of.number, voxels.begin, signs, y, z, size.x);
    const int row = memory.row(y, z);
    for (int x = in.begin; x < in.end; ++x) {
      atomicMin(&memory.owner[row + x], owner);
      if constexpr (kCountsOwners) atomicAdd(&memory.several[row + x], 1u);
    }
  }

  __device__ void mark_all(int slots, bool by_slot) const {
    for (int item = thread; item < slots * kTileRows; item += kTileThreads) {
      const int slot = item / kTileRows;
      mark(slot, item % kTileJ, item % kTileRows / kTileJ,
           by_slot ? static_cast<unsigned>(slot) : memory.slots[slot].number);
    }
  }

  /// A list for which there is room, in the order of the numbers. @param list  of the tile's tetrahedra, in any
  __device__ void rasterise_few(const unsigned* list, int count) const {
    static_assert(kSlots <= kTileThreads);
    unsigned number = kNoTetrahedron;
    if (thread < count) memory.numbers[thread] = number = list[thread];
    __syncthreads();
    if (thread < count) {
      int slot = 0;
      for (int n = 0; n < count; ++n) slot += memory.numbers[n] < number;
      prepare(slot, number);
    }
    __syncthreads();
    mark_all(count, true);
    __syncthreads();
    if (thread < count) weigh(thread);
    __syncthreads();
  }

  /// Any list, as many at a time as there is room for.
  __device__ void rasterise_many(const unsigned* list, unsigned long long count) const {
    for (unsigned long long from = 0; from < count; from += kSlots) {
      const int slots = static_cast<int>(min(count - from, static_cast<unsigned long long>(kSlots)));
      __syncthreads();
      if (thread < slots) prepare(thread, list[from + static_cast<unsigned>(thread)]);
      __syncthreads();
      mark_all(slots, false);
    }
    __syncthreads();
  }

  /// What the voxels of a tetrahedron need, in the place of its faces.
  __device__ void weigh(int slot) const {
    const Tetrahedron t = task.mesh.tetrahedron(memory.slots[slot].number);
    const glm::i32vec3& d = t.d.deformed;
    const auto further = [&](const Vertex& v) { return glm::vec3(t.d.u - v.u); };
    prepare_weighing(glm::vec3(t.a.deformed - d), glm::vec3(t.b.deformed - d), glm::vec3(t.c.deformed - d),
                     glm::vec3(voxels.begin * kStepsPerVoxel - d),
                     {glm::vec3(-t.d.u), further(t.a), further(t.b), further(t.c)}, memory.prepared[slot],
                     memory.ends[slot]);
    if (is_long(t)) memory.prepared[slot][0].w = kNoNumber;
  }

  /// The voxels of one lane, a column along k, where slots own. @return how many are covered
  template <class Sink>
  __device__ unsigned sample_few(const Sink& sink) const {
    const int lane = thread & 31, y = thread / 32;
    if (lane >= size.x || y >= size.y) return 0;
    const unsigned* owner = &memory.owner[memory.row(y, 0) + lane];
    const auto next_place = [&] {
      const unsigned place = *owner;
      owner += kTileJ * kRowStride;
      return place;
    };
    return sample_column<false>(sink, weighings(), voxels.begin + glm::ivec3(lane, y, 0),
                                glm::vec3(lane * kStepsPerVoxel, y * kStepsPerVoxel, 0), size.z, next_place,
                                [&](int z) { return finish_few(sink, lane, y, z); });
  }
  __device__ Weighings weighings() const { return {memory.prepared, memory.ends, kSlots}; }
  /// A voxel that `sample_few` has not written. @return whether it is covered
  template <class Sink>
  __device__ bool finish_few(const Sink& sink, int x, int y, int z) const {
    const glm::ivec3 in_tile(x, y, z), at = voxels.begin + in_tile;
    const unsigned slot = memory.owner[memory.row(y, z) + x];
    if (slot == kNoTetrahedron) {
      sink.nothing(sink.place(at));
      return false;
    }
    return finish_voxel(sink, weighings(), slot, at, glm::vec3(in_tile * kStepsPerVoxel), [&](int out) {
      return write_slowly(task.mesh, sink, memory.slots[slot].number, out, at, signs);
    });
  }

  /// The same where numbers own: a tetrahedron's map is made when a column enters it.
  template <class Sink>
  __device__ unsigned sample_many(const Sink& sink) const {
    unsigned covered = 0, held = kNoTetrahedron;
    TetrahedronMap map(Tetrahedron{});
    for_each_of_column(sink, [&](const glm::ivec3& at, int place, int out) {
      const unsigned number = memory.owner[place];
      if (number == kNoTetrahedron) return sink.nothing(out);
      if (number != held) map = TetrahedronMap(task.mesh.tetrahedron(number));
      held = number;
      const glm::i32vec3 steps = at * kStepsPerVoxel;
      covered +=
          sink.write(out, at, map.u(steps, [&] { return interpolate_exactly(task.mesh, number, steps, signs); }));
    });
    return covered;
  }

  /// Calls `work(voxel, its place in `owner`, its place in the output)` for the voxels of one lane.
  template <class Sink, class Work>
  __device__ void for_each_of_column(const Sink& sink, Work&& work) const {
    const int lane = thread & 31, y = thread / 32;
    if (lane >= size.x || y >= size.y) return;
    glm::ivec3 at = voxels.begin + glm::ivec3(lane, y, 0);
    int out = sink.place(at);
    for (int z = 0; z < size.z; ++z, ++at.z, out += sink.per_slice()) work(at, memory.row(y, z) + lane, out);
  }

  __device__ unsigned finish(const OwnerSink& sink, bool is_few) const {
    for_each_of_column(sink, [&](const glm::ivec3&, int place, int out) {
      const unsigned owner = memory.owner[place];
      sink.owner[out] = is_few && owner != kNoTetrahedron ? memory.slots[owner].number : owner;
      if constexpr (kCountsOwners) sink.several[out] = static_cast<std::uint16_t>(min(memory.several[place], 65535u));
    });
    return 0;
  }
  __device__ unsigned finish(const HoleSink& sink, bool) const {
    for_each_of_column(sink, [&](const glm::ivec3&, int place, int out) {
      if (memory.owner[place] == kNoTetrahedron) sink.nothing(out);
    });
    return 0;
  }
  template <class Sink>
  __device__ unsigned finish(const Sink& sink, bool is_few) const {
    return is_few ? sample_few(sink) : sample_many(sink);
  }
};

template <class Sink>
constexpr bool is_wide() {
  if constexpr (requires { Sink::kIsWide; }) return Sink::kIsWide;
  return false;
}

/// A block a tile that the box reaches.
template <bool kCountsOwners, class Sink>
__global__ void __launch_bounds__(kTileThreads, is_wide<Sink>() ? kTileBlocks - 1 : kTileBlocks)
    mesh_tile_kernel(const __grid_constant__ MeshTask task, const __grid_constant__ IntBox box,
                     const __grid_constant__ glm::ivec3 first_tile, const __grid_constant__ Sink sink,
                     unsigned long long* covered) {
  __shared__ TileMemory<kCountsOwners> memory;
  const glm::ivec3 tile = first_tile + glm::ivec3(blockIdx.x, blockIdx.y, blockIdx.z);
  IntBox voxels = task.voxels(tile);
  voxels = {glm::max(voxels.begin, box.begin), glm::min(voxels.end, box.end)};
  const glm::i64vec3 first_voxel(voxels.begin);
  const TileWorker<kCountsOwners> worker{task,
                                         memory,
                                         voxels,
                                         voxels.end - voxels.begin,
                                         task.mesh.nudge.signs(first_voxel),
                                         static_cast<int>(threadIdx.x)};
  worker.clear();
  const int number = task.number_of(tile);
  const unsigned long long first = task.first[number], count = task.first[number + 1] - first;
  const bool is_few = count <= kSlots;
  if (is_few) {
    worker.rasterise_few(task.numbers + first, static_cast<int>(count));
  } else {
    worker.rasterise_many(task.numbers + first, count);
  }
  const unsigned found = warp_sum(worker.finish(sink, is_few));
  if ((worker.thread & 31) == 0) atomicAdd(&memory.covered, found);
  __syncthreads();
  if (worker.thread == 0 && memory.covered != 0) atomicAdd(covered, static_cast<unsigned long long>(memory.covered));
}

}  // namespace

std::uint64_t MeshRaster::bytes_of(const SnappedMesh& mesh) {
  return mesh.vertices.size() * sizeof(Vertex) + mesh.tetrahedra.size() * sizeof(glm::u32vec4);
}

std::uint64_t MeshRaster::held_bytes() const {
  return vertices_.capacity() * sizeof(Vertex) + tetrahedra_.capacity() * sizeof(glm::u32vec4) +
         numbers_.capacity() * sizeof(unsigned);
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
  list_kernel<true><<<blocks, kThreads, 0, stream>>>(task);
  std::size_t bytes = 0;
  const auto scan = [&](void* memory) {
    TETWARP_CUDA_TRY(cub::DeviceScan::ExclusiveSum(memory, bytes, first_.data(), first_.data(),
                                                   static_cast<std::int64_t>(tiles + 1), stream));
  };
  scan(nullptr);
  scan(scan_.reserve(bytes));
  unsigned long long pairs = 0;
  TETWARP_CUDA_TRY(cudaMemcpyAsync(&pairs, first_.data() + tiles, sizeof pairs, cudaMemcpyDeviceToHost, stream));
  TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  task.numbers = numbers_.reserve(std::max<std::size_t>(pairs, 1));
  list_kernel<false><<<blocks, kThreads, 0, stream>>>(task);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

template <class Sink>
void MeshRaster::run(const SlabBox& box, const Sink& sink, cudaStream_t stream) {
  const MeshTask task{view(), count_, size_, origin_, tiles_, first_.data(), next_.data(), numbers_.data()};
  const IntBox in{glm::ivec3(box.begin), glm::ivec3(box.begin + box.size)};
  const glm::ivec3 extent(kTileI, kTileJ, kTileK), first = (in.begin - origin_) / extent,
                                                   tiles = (in.end - 1 - origin_) / extent - first + 1;
  const dim3 grid(static_cast<unsigned>(tiles.x), static_cast<unsigned>(tiles.y), static_cast<unsigned>(tiles.z));
  covered_.fill(0, 1, stream);
  const auto launch = [&](auto counts) {
    mesh_tile_kernel<decltype(counts)::value>
        <<<grid, kTileThreads, 0, stream>>>(task, in, first, sink, covered_.data());
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

std::uint64_t MeshRaster::covered(cudaStream_t stream) const {
  unsigned long long covered = 0;
  covered_.download(&covered, 1, stream);
  return covered;
}

template void MeshRaster::run(const SlabBox&, const OwnerSink&, cudaStream_t);
template void MeshRaster::run(const SlabBox&, const HoleSink&, cudaStream_t);
template void MeshRaster::run(const SlabBox&, const OffsetSink&, cudaStream_t);
template void MeshRaster::run(const SlabBox&, const VolumesSink<void>&, cudaStream_t);
template void MeshRaster::run(const SlabBox&, const VolumesSink<std::int16_t>&, cudaStream_t);
template void MeshRaster::run(const SlabBox&, const VoxelSink<std::uint8_t>&, cudaStream_t);
template void MeshRaster::run(const SlabBox&, const VoxelSink<std::int16_t>&, cudaStream_t);
template void MeshRaster::run(const SlabBox&, const VoxelSink<std::uint16_t>&, cudaStream_t);

}  // namespace tetwarp::cuda_detail
