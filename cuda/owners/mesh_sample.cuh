// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/sample_column.cuh"
#include "cuda/owners/mesh_tile.cuh"

/// The resolve of a tile of the mesh raster: from the owners of its voxels to what a sink wants of them. For
/// mesh_raster.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// What is rarely called, so out of line, with everything by value.
__device__ __noinline__ glm::vec3 interpolate_exactly(MeshRaster::View mesh, unsigned number, glm::i32vec3 steps,
                                                      glm::i32vec3 signs) {
  return interpolate_u_exactly(mesh.tetrahedron(number), steps, signs);
}
template <class Sink>
__device__ __noinline__ bool write_mesh_voxel(const MeshRaster::View& mesh, const Sink& sink, unsigned number, int out,
                                              glm::ivec3 at, glm::i32vec3 signs) {
  return sink.write(out, at, interpolate_u(mesh.tetrahedron(number), at * kStepsPerVoxel, signs));
}
__device__ __noinline__ glm::i64vec3 thin_u_of(MeshRaster::View mesh, unsigned number, glm::ivec3 at,
                                               glm::i32vec3 signs) {
  return thin_u(mesh.tetrahedron(number), at, signs);
}

/// Goes along the columns of a tile, a lane each.
template <bool kCountsOwners>
struct MeshSampler {
  const MeshTile<kCountsOwners>& tile;

  /// The voxels of one lane, a column along k, where slots own. @return how many are covered
  template <class Sink>
  __device__ unsigned sample_few(const Sink& sink) const {
    const int lane = tile.lane(), y = tile.warp();
    if (lane >= tile.size.x || y >= tile.size.y) return 0;
    const unsigned* owner = &tile.memory.owner[tile.memory.row(y, 0) + lane];
    const auto next_slot = [&] {
      const unsigned slot = *owner;
      owner += kTileJ * kRowStride;
      return slot;
    };
    return sample_column<false>(sink, places(), tile.voxels.begin + glm::ivec3(lane, y, 0), glm::ivec3(lane, y, 0),
                                tile.size.z, next_slot, [&](int z) { return finish_few(sink, lane, y, z); });
  }
  __device__ Weighings places() const { return {tile.memory.prepared, tile.memory.ends, kMeshSlots}; }
  /// A voxel that `sample_few` has not written. @return whether it is covered
  template <class Sink>
  __device__ bool finish_few(const Sink& sink, int x, int y, int z) const {
    const glm::ivec3 in_tile(x, y, z), at = tile.voxels.begin + in_tile;
    const unsigned slot = tile.memory.owner[tile.memory.row(y, z) + x];
    if (slot == kNoTetrahedron) {
      sink.nothing(sink.address(at));
      return false;
    }
    return finish_voxel(sink, places(), slot, at, in_tile, [&](int out) {
      return write_mesh_voxel(tile.task.mesh, sink, tile.memory.slots[slot].number, out, at, tile.signs);
    });
  }

  /// The voxels of one lane, a column along k, where numbers own: a tetrahedron's map is made when a column enters it.
  template <class Sink>
  __device__ unsigned sample_many(const Sink& sink) const {
    unsigned covered = 0, held = kNoTetrahedron;
    constexpr bool kCoarse = Sink::kLerp == Lerp::fused;
    using Map = std::conditional_t<kCoarse, CoarseMap, TetrahedronMap>;
    Map map(Tetrahedron{});
    for_each_of_column(sink, [&](const glm::ivec3& at, int at_tile, int out) {
      const unsigned number = tile.memory.owner[at_tile];
      if (number == kNoTetrahedron) return sink.nothing(out);
      if (number != held) map = Map(tile.task.mesh.tetrahedron(number));
      held = number;
      if constexpr (kCoarse) {
        const glm::i64vec3 u = map.is_thin ? thin_u_of(tile.task.mesh, number, at, tile.signs) : map.u(at);
        covered += sink.write(out, at, fixed_offset(u));
      } else {
        const glm::i32vec3 steps = at * kStepsPerVoxel;
        covered += sink.write(
            out, at, map.u(steps, [&] { return interpolate_exactly(tile.task.mesh, number, steps, tile.signs); }));
      }
    });
    return covered;
  }

  /// Calls `work(voxel, its index in `owner`, its address in the output)` for the voxels of one lane.
  template <class Sink, class Work>
  __device__ void for_each_of_column(const Sink& sink, Work&& work) const {
    const int lane = tile.lane(), y = tile.warp();
    if (lane >= tile.size.x || y >= tile.size.y) return;
    glm::ivec3 at = tile.voxels.begin + glm::ivec3(lane, y, 0);
    int out = sink.address(at);
    for (int z = 0; z < tile.size.z; ++z, ++at.z, out += sink.per_slice()) work(at, tile.memory.row(y, z) + lane, out);
  }

  __device__ unsigned finish(const OwnerSink& sink, bool is_few) const {
    for_each_of_column(sink, [&](const glm::ivec3&, int at_tile, int out) {
      const unsigned owner = tile.memory.owner[at_tile];
      sink.owner[out] = is_few && owner != kNoTetrahedron ? tile.memory.slots[owner].number : owner;
      if constexpr (kCountsOwners)
        sink.several[out] = static_cast<std::uint16_t>(min(tile.memory.several[at_tile], 65535u));
    });
    return 0;
  }
  __device__ unsigned finish(const HoleSink& sink, bool) const {
    for_each_of_column(sink, [&](const glm::ivec3&, int at_tile, int out) {
      if (tile.memory.owner[at_tile] == kNoTetrahedron) sink.nothing(out);
    });
    return 0;
  }
  template <class Sink>
  __device__ unsigned finish(const Sink& sink, bool is_few) const {
    if constexpr (Sink::kLerp == Lerp::separate) {
      if (is_few) return sample_few(sink);
    }
    return sample_many(sink);
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
