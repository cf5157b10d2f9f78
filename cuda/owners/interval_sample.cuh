// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/voxel_sink.cuh"
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

/// What the voxels of the first tetrahedra of the list need, in the place of their faces. A thread a tetrahedron;
/// voxels of those beyond the first 256 are found one by one.
__device__ void weigh(const IntervalTile& tile) {
  TileMemory& memory = tile.memory;
  const int thread = tile.thread;
  if (thread >= static_cast<int>(min(memory.count, static_cast<unsigned>(kSlots)))) return;
  const StepLattice& lattice = tile.task.lattice;
  const unsigned number = memory.numbers[thread];
  const LatticeTetrahedron t = tile.tetrahedron(number);
  const Corners at = tile.corners(number);
  // What `LocalTetrahedron` has; all numbers are whole and exact.
  const glm::i32vec3 d = tile.vertex(at.d), cell(lattice.cell), edge = t.direction() * cell;
  const glm::i32vec3 rest = glm::i32vec3(lattice.first) + t.d * cell - tile.voxels.begin * kStepsPerVoxel;
  const glm::vec3 moved(d - rest);
  const auto vertex_at = [&](int corner, int axis, glm::vec3& moved_further) {
    const glm::i32vec3 to = tile.vertex(corner) - d;
    glm::i32vec3 further = to;
#pragma unroll
    for (int k = 0; k < 3; ++k)
      if ((k == axis) != t.centre) further[k] -= edge[k];
    moved_further = further;
    return glm::vec3(to);
  };
  glm::vec3 moved_a, moved_b, moved_c;
  const glm::vec3 a = vertex_at(at.a, 0, moved_a), b = vertex_at(at.b, 1, moved_b), c = vertex_at(at.c, 2, moved_c);
  prepare_weighing(a, b, c, glm::vec3(-d), {moved, moved_a, moved_b, moved_c}, memory.prepared[thread],
                   memory.ends[thread]);
}

/// A voxel whose weights are not for float. Rarely called, so out of line, with everything by value.
template <class Sink>
__device__ __noinline__ bool write_slowly(const TileTask& task, const Sink& sink, LatticeTetrahedron t, int out,
                                          glm::ivec3 at, glm::i32vec3 signs) {
  return sink.write(out, at, offset_in(task.lattice, t, at, signs));
}

/// Samples the columns of a tile along k, a lane each.
template <class Sink>
struct ColumnSampler {
  const IntervalTile& tile;
  const Sink& sink;

  __device__ Weighings weighings() const { return {tile.memory.prepared, tile.memory.ends, kSlots}; }

  /// The column of this lane. @tparam kInside  whether all voxels come from well inside the source
  /// @return how many are covered
  template <bool kInside>
  __device__ unsigned sample() const {
    const int lane = tile.lane(), y = tile.warp();
    if (lane >= tile.size.x || y >= tile.size.y) return 0;
    const IntervalRow* row = &tile.memory.rows[y];
    const unsigned up_to_lane = lowest_bits(lane + 1);
    const auto next_slot = [&]() -> unsigned {
      const IntervalRow& of = *row;
      row += kTileJ;
      return of.owner[last_bit(of.starts & up_to_lane)];
    };
    return sample_column<kInside>(sink, weighings(), tile.voxels.begin + glm::ivec3(lane, y, 0),
                                  glm::vec3(lane * kStepsPerVoxel, y * kStepsPerVoxel, 0), tile.size.z, next_slot,
                                  [&](int z) { return finish(lane, y, z); });
  }

  /// A voxel that `sample` has not written. @return whether it is covered
  __device__ bool finish(int x, int y, int z) const {
    const glm::ivec3 in_tile(x, y, z), at = tile.voxels.begin + in_tile;
    const unsigned entry = tile.memory.rows[z * kTileJ + y].owner_of(x);
    if (entry == kNoOwner) {
      sink.nothing(sink.address(at));
      return false;
    }
    return finish_voxel(sink, weighings(), entry, at, glm::vec3(in_tile * kStepsPerVoxel), [&](int out) {
      return write_slowly(tile.task, sink, tile.tetrahedron(tile.memory.numbers[entry]), out, at, tile.signs);
    });
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
