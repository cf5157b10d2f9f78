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

/// The maps of the first tetrahedra of the list, in the place of their faces. A thread a tetrahedron; voxels of those
/// beyond the first 256 are found one by one.
__device__ void map_tetrahedra(const IntervalTile& tile) {
  TileMemory& memory = tile.memory;
  const int thread = tile.thread;
  if (thread >= static_cast<int>(min(memory.count, static_cast<unsigned>(kSlots)))) return;
  const StepLattice& lattice = tile.task.lattice;
  const unsigned number = memory.numbers[thread];
  const LatticeTetrahedron t = tile.tetrahedron(number);
  const Corners at = tile.corners(number);
  const glm::i32vec3 d = tile.vertex(at.d), cell(lattice.cell), edge = t.direction() * cell;
  const glm::i32vec3 rest = glm::i32vec3(lattice.first) + t.d * cell - tile.voxels.begin * kStepsPerVoxel;
  const auto vertex_at = [&](int corner, int axis, glm::dvec3& u) {
    const glm::i32vec3 to = tile.vertex(corner) - d;
    glm::i32vec3 further = -to;
#pragma unroll
    for (int k = 0; k < 3; ++k)
      if ((k == axis) != t.centre) further[k] += edge[k];
    u = glm::dvec3(further);
    return glm::dvec3(to);
  };
  glm::dvec3 ua, ub, uc;
  const glm::dvec3 a = vertex_at(at.a, 0, ua), b = vertex_at(at.b, 1, ub), c = vertex_at(at.c, 2, uc);
  const CoarseMap map(a, b, c, d, glm::dvec3(rest - d), ua, ub, uc);
  memory.usable[thread] = put_map(map, glm::ivec3(0), memory.prepared[thread]) ? 1 : 0;
}

/// A voxel whose owner has no map at hand. Rarely called, so out of line, with everything by value.
template <class Sink>
__device__ __noinline__ bool write_slowly(const TileTask& task, const Sink& sink, LatticeTetrahedron t, int out,
                                          glm::ivec3 at, glm::i32vec3 signs) {
  return sink.write(out, at, fixed_offset(coarse_u(vertices_of(task.lattice, t), at, signs)));
}

/// Samples the columns of a tile along k, a lane each.
template <class Sink>
struct ColumnSampler {
  const IntervalTile& tile;
  const Sink& sink;

  __device__ CoarseMaps<kQuads> maps() const { return {tile.memory.prepared, tile.memory.usable, kSlots}; }

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
    return sample_column<kInside>(sink, maps(), tile.voxels.begin + glm::ivec3(lane, y, 0), glm::ivec3(lane, y, 0),
                                  tile.size.z, next_slot, [&](int z) { return finish(lane, y, z); });
  }

  /// A voxel that `sample` has not written. @return whether it is covered
  __device__ bool finish(int x, int y, int z) const {
    const glm::ivec3 in_tile(x, y, z), at = tile.voxels.begin + in_tile;
    const unsigned entry = tile.memory.rows[z * kTileJ + y].owner_of(x);
    if (entry == kNoOwner) {
      sink.nothing(sink.address(at));
      return false;
    }
    return finish_voxel(sink, maps(), entry, at, in_tile, [&](int out) {
      return write_slowly(tile.task, sink, tile.tetrahedron(tile.memory.numbers[entry]), out, at, tile.signs);
    });
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
