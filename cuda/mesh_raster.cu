#include "cuda/mesh_raster.h"

#include <cub/device/device_scan.cuh>

#include "cuda/gather.h"
#include "cuda/voxel_sink.cuh"
#include "deform/core/row_interval.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kTileI = 32, kTileJ = 8, kTileK = 16;  ///< voxels of a tile
constexpr int kTileRows = kTileJ * kTileK;
constexpr int kTileThreads = 32 * kTileJ;  ///< a warp a column of rows
constexpr int kTileBlocks = 4;             ///< a multiprocessor
constexpr int kSlots = 64;                 ///< tetrahedra whose faces are prepared at a time
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
  RowFaces faces[kSlots];
  struct Slot {
    unsigned number;
    short y_begin, y_end, z_begin, z_end;
    bool has_faces;
  } slots[kSlots];
  unsigned owner[kTileRows * kRowStride];
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

/// A thread block at work on a tile, or the part of it that a box has.
template <bool kCountsOwners>
struct TileWorker {
  const MeshTask& task;
  TileMemory<kCountsOwners>& memory;
  IntBox voxels;
  glm::ivec3 size;
  glm::i32vec3 signs;
  int thread;

  __device__ void clear() const {
    for (int n = thread; n < kTileRows * kRowStride; n += kTileThreads) {
      memory.owner[n] = kNoTetrahedron;
      if constexpr (kCountsOwners) memory.several[n] = 0;
    }
    if (thread == 0) memory.covered = 0;
  }

  __device__ void prepare(int slot, unsigned number) const {
    const Tetrahedron t = task.mesh.tetrahedron(number);
    const VoxelBox reached =
        detail::candidates(task.mesh.nudge, box_of(t), {glm::i64vec3(voxels.begin), glm::i64vec3(voxels.end)});
    typename TileMemory<kCountsOwners>::Slot& to = memory.slots[slot];
    to = {number, 0, 0, 0, 0, false};
    if (detail::is_empty(reached)) return;
    to.y_begin = static_cast<short>(reached.begin.y - voxels.begin.y);
    to.y_end = static_cast<short>(reached.end.y - voxels.begin.y);
    to.z_begin = static_cast<short>(reached.begin.z - voxels.begin.z);
    to.z_end = static_cast<short>(reached.end.z - voxels.begin.z);
    to.has_faces = make_row_faces(t, voxels.begin, signs, size, memory.faces[slot]);
  }

  __device__ void mark(int slot, int y, int z) const {
    const auto& of = memory.slots[slot];
    if (y < of.y_begin || y >= of.y_end || z < of.z_begin || z >= of.z_end) return;
    bool is_certain = false;
    RowInterval in{0, 0};
    if (of.has_faces) in = RowsAlongZ(memory.faces[slot], y).interval(z, size.x, is_certain);
    if (!is_certain) in = exactly(task.mesh, of.number, voxels.begin, signs, y, z, size.x);
    const int row = memory.row(y, z);
    for (int x = in.begin; x < in.end; ++x) {
      atomicMin(&memory.owner[row + x], of.number);
      if constexpr (kCountsOwners) atomicAdd(&memory.several[row + x], 1u);
    }
  }

  /// All tetrahedra of the tile, as many at a time as there is room for.
  __device__ void rasterise(unsigned long long first, unsigned long long last) const {
    for (; first < last; first += kSlots) {
      const int slots = static_cast<int>(min(last - first, static_cast<unsigned long long>(kSlots)));
      __syncthreads();
      if (thread < slots) prepare(thread, task.numbers[first + static_cast<unsigned>(thread)]);
      __syncthreads();
      for (int item = thread; item < slots * kTileRows; item += kTileThreads)
        mark(item / kTileRows, item % kTileJ, item % kTileRows / kTileJ);
    }
    __syncthreads();
  }

  /// The voxels of one lane: a column along k. @return how many are covered
  template <class Sink>
  __device__ unsigned finish(const Sink& sink) const {
    const int lane = thread & 31, y = thread / 32;
    if (lane >= size.x || y >= size.y) return 0;
    glm::ivec3 at = voxels.begin + glm::ivec3(lane, y, 0);
    int out = sink.place(at);
    unsigned covered = 0, held = kNoTetrahedron;
    TetrahedronMap map(Tetrahedron{});
    for (int z = 0; z < size.z; ++z, ++at.z, out += sink.per_slice()) {
      const int place = memory.row(y, z) + lane;
      const unsigned number = memory.owner[place];
      if constexpr (std::is_same_v<Sink, OwnerSink>) {
        sink.owner[out] = number;
        if constexpr (kCountsOwners) sink.several[out] = static_cast<std::uint16_t>(min(memory.several[place], 65535u));
      } else if constexpr (std::is_same_v<Sink, HoleSink>) {
        if (number == kNoTetrahedron) sink.nothing(out);
      } else {
        if (number == kNoTetrahedron) {
          sink.nothing(out);
          continue;
        }
        if (number != held) map = TetrahedronMap(task.mesh.tetrahedron(number));
        held = number;
        const glm::i32vec3 steps = at * kStepsPerVoxel;
        const glm::vec3 u = map.u(steps, [&] { return interpolate_exactly(task.mesh, number, steps, signs); });
        covered += sink.write(out, at, u);
      }
    }
    return covered;
  }
};

/// A block a tile that the box reaches.
template <bool kCountsOwners, class Sink>
__global__ void __launch_bounds__(kTileThreads, kTileBlocks)
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
  worker.rasterise(task.first[number], task.first[number + 1]);
  const unsigned found = warp_sum(worker.finish(sink));
  if ((worker.thread & 31) == 0) atomicAdd(&memory.covered, found);
  __syncthreads();
  if (worker.thread == 0 && memory.covered != 0) atomicAdd(covered, static_cast<unsigned long long>(memory.covered));
}

/// Where tiles begin, so that none has voxels of both sides of the nudge's turn.
int tile_origin(std::int64_t end, std::int64_t turn, int size) {
  return turn > 0 && turn < end ? static_cast<int>(turn - (turn + size - 1) / size * size) : 0;
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
    origin_[axis] = tile_origin(output.size[axis], mesh.nudge.first_down(axis), extent[axis]);
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
