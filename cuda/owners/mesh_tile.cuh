// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/weighing.cuh"
#include "cuda/owners/mesh_list.cuh"
#include "cuda/runtime/warp.cuh"

/// A tile of the mesh raster, and the walk along its rows: each tetrahedron of its list enters itself where it owns,
/// and an atomic minimum keeps the lowest. For mesh_raster.cu alone.
namespace tetwarp::cuda_detail {

namespace {

constexpr int kMeshSlots = 112;         ///< tetrahedra whose arithmetic is prepared at a time
constexpr int kRowStride = kTileI + 1;  ///< so that a column of rows lies in different banks

/// The shared memory of a tile.
///
///     prepared  113 x 6 x 16      a slot for each tetrahedron at hand: first its four faces; where all of
///                                 a tile's have slots, its `Weighing` once all rows are marked
///     ends      113 x 4           the last float of each `Weighing`
///     slots     112 x 16          which tetrahedron, and the rows that it may reach
///     numbers   112 x 4           of the list, before they are sorted
///     owner     128 x 33 x 4      row y, z from (z * 8 + y) * 33 on: the lowest so far
///     several   128 x 33 x 4      how many own it, where that is counted
template <bool kCountsOwners>
struct MeshTileMemory {
  /// A tetrahedron of the list, and the rows that it may reach.
  struct Slot {
    unsigned number;
    short y_begin, y_end, z_begin, z_end;
    short lower;  ///< of `RowFaces`; 0: exact integers must say
  };
  float4 prepared[kMeshSlots + 1][kQuads];  ///< faces, and then `Weighing`, the last nobody's
  float ends[kMeshSlots + 1];               ///< the last float of each `Weighing`
  Slot slots[kMeshSlots];
  unsigned numbers[kMeshSlots];            ///< before they are sorted
  unsigned owner[kTileRows * kRowStride];  ///< slot where all have one, else number; or kNoTetrahedron
  unsigned several[kCountsOwners ? kTileRows * kRowStride : 1];
  unsigned covered;

  /// Where a row begins.
  __device__ static int row(int y, int z) { return (z * kTileJ + y) * kRowStride; }
};

/// Rarely called, so out of line, with everything by value.
__device__ __noinline__ RowInterval exact_mesh_row(MeshRaster::View mesh, unsigned number, glm::ivec3 first,
                                                   glm::i32vec3 signs, int y, int z, int count) {
  return exact_row(mesh.tetrahedron(number), first, signs, y, z, count);
}
/// A thread block at work on a tile, or the part of it that a box has.
template <bool kCountsOwners>
struct MeshTile {
  using Memory = MeshTileMemory<kCountsOwners>;

  const MeshTask& task;
  Memory& memory;
  IntBox voxels;       ///< of the box that the tile has
  glm::ivec3 size;     ///< how many, on each axis
  glm::i32vec3 signs;  ///< nudge of all of them
  int thread;

  __device__ int lane() const { return thread & 31; }
  __device__ int warp() const { return thread / 32; }

  /// Nobody owns anything.
  __device__ void clear() const {
    for (int n = thread; n < kTileRows * kRowStride; n += kTileThreads) {
      memory.owner[n] = kNoTetrahedron;
      if constexpr (kCountsOwners) memory.several[n] = 0;
    }
    if (thread != 0) return;
    memory.prepared[kMeshSlots][0] = make_float4(0, 0, 0, kNoNumber);
    memory.ends[kMeshSlots] = 0;
    memory.covered = 0;
  }

  /// The rows that a tetrahedron may reach, and its faces.
  __device__ void prepare(int slot, unsigned number) const {
    const Tetrahedron t = task.mesh.tetrahedron(number);
    const Region reached =
        detail::candidates(task.mesh.nudge, box_of(t), {glm::i64vec3(voxels.begin), glm::i64vec3(voxels.end)});
    typename Memory::Slot& to = memory.slots[slot];
    to = {number, 0, 0, 0, 0, 0};
    if (is_empty(reached)) return;
    to.y_begin = static_cast<short>(reached.begin.y - voxels.begin.y);
    to.y_end = static_cast<short>(reached.end.y - voxels.begin.y);
    to.z_begin = static_cast<short>(reached.begin.z - voxels.begin.z);
    to.z_end = static_cast<short>(reached.end.z - voxels.begin.z);
    RowFaces faces;
    if (!make_row_faces(t, voxels.begin, signs, size, faces)) return;
    to.lower = static_cast<short>(faces.lower);
    for (int n = 0; n < 4; ++n) memory.prepared[slot][n] = in_quad(faces.faces[n]);
  }

  /// Where the faces of the tetrahedron in a slot cross the rows.
  __device__ RowFaces faces_of(int slot) const {
    return faces_in_quads(memory.prepared[slot], memory.slots[slot].lower);
  }

  /// Marks the interval of a row. @param owner  to be the voxels' owner, where it is the lowest
  __device__ void mark(int slot, int y, int z, unsigned owner) const {
    const auto& of = memory.slots[slot];
    if (y < of.y_begin || y >= of.y_end || z < of.z_begin || z >= of.z_end) return;
    bool is_certain = false;
    RowInterval in{0, 0};
    if (of.lower != 0) in = RowsAlongZ(faces_of(slot), y).interval(z, size.x, is_certain);
    if (!is_certain) in = exact_mesh_row(task.mesh, of.number, voxels.begin, signs, y, z, size.x);
    const int row = memory.row(y, z);
    for (int x = in.begin; x < in.end; ++x) {
      atomicMin(&memory.owner[row + x], owner);
      if constexpr (kCountsOwners) atomicAdd(&memory.several[row + x], 1u);
    }
  }

  /// Marks the rows of all slots, a row a thread.
  /// @param by_slot  whether slots are entered as owners, which are in the order of the numbers; else numbers
  __device__ void mark_all(int slots, bool by_slot) const {
    for (int item = thread; item < slots * kTileRows; item += kTileThreads) {
      const int slot = item / kTileRows;
      mark(slot, item % kTileJ, item % kTileRows / kTileJ,
           by_slot ? static_cast<unsigned>(slot) : memory.slots[slot].number);
    }
  }

  /// A list for which there is room, in the order of the numbers. @param list  of the tile's tetrahedra, in any
  __device__ void rasterise_few(const unsigned* list, int count) const {
    static_assert(kMeshSlots <= kTileThreads);
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
    for (unsigned long long from = 0; from < count; from += kMeshSlots) {
      const int slots = static_cast<int>(min(count - from, static_cast<unsigned long long>(kMeshSlots)));
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
    float end = 0;
    prepare_weighing(glm::vec3(t.a.deformed - d), glm::vec3(t.b.deformed - d), glm::vec3(t.c.deformed - d),
                     glm::vec3(voxels.begin * kStepsPerVoxel - d),
                     {glm::vec3(-t.d.u), further(t.a), further(t.b), further(t.c)}, memory.prepared[slot], end);
    memory.ends[slot] = end;
    if (is_long(t)) memory.prepared[slot][0].w = kNoNumber;
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
