// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/mesh_raster.cuh"
#include "cuda/owners/tile.cuh"
#include "deform/core/gather.h"

/// The set-up of the mesh raster: for each tile, the tetrahedra that may reach it. For mesh_raster.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// What all kernels of the mesh raster know.
struct MeshTask {
  MeshRaster::View mesh;
  unsigned count;             ///< tetrahedra
  glm::ivec3 size;            ///< of the output
  glm::ivec3 origin, tiles;   ///< first voxel of the first tile; how many on each axis
  unsigned long long* first;  ///< of each tile, i fastest, and of one more: first how many its list has; after the scan
                              ///< where it begins
  unsigned* next;             ///< of each tile: how many are written so far
  unsigned* numbers;          ///< the lists, one after another, each in any order

  /// The voxels of a tile that the output has.
  __device__ IntBox voxels(const glm::ivec3& tile) const {
    const glm::ivec3 extent(kTileI, kTileJ, kTileK), begin = origin + tile * extent;
    return {glm::max(begin, glm::ivec3(0)), glm::min(begin + extent, size)};
  }
  __device__ int number_of(const glm::ivec3& tile) const { return (tile.z * tiles.y + tile.y) * tiles.x + tile.x; }
};

/// One warp a tetrahedron: counts it for every tile that it may reach, or writes its number to their lists. Lanes share
/// out the tiles of its box.
///
///     count -> exclusive scan over the tiles (cub::DeviceScan) -> write
///
/// @tparam kCounts  whether it counts: `first` is added to, 0 before; else `next`, 0 before, and `numbers` are written
template <bool kCounts>
__global__ void mesh_list_kernel(MeshTask task) {
  const std::int64_t number = warp_of_grid();
  if (number >= task.count) return;
  const Tetrahedron t = task.mesh.tetrahedron(static_cast<unsigned>(number));
  const Region reached = detail::candidates(task.mesh.nudge, box_of(t), {glm::i64vec3(0), glm::i64vec3(task.size)});
  if (is_empty(reached)) return;
  const glm::ivec3 extent(kTileI, kTileJ, kTileK),
      begin = (glm::ivec3(reached.begin) - task.origin) / extent,
      size = (glm::ivec3(reached.end) - 1 - task.origin) / extent - begin + 1;
  const TetrahedronPlanes planes(t);
  const std::int64_t tiles = std::int64_t{size.x} * size.y * size.z;
  for (std::int64_t n = threadIdx.x & 31; n < tiles; n += 32) {
    const glm::ivec3 tile = begin + glm::ivec3(unravel(n, glm::i64vec3(size)));
    const IntBox box = task.voxels(tile);
    if (tiles > 1 && !planes.may_reach({glm::i64vec3(box.begin), glm::i64vec3(box.end)})) continue;
    const int n_tile = task.number_of(tile);
    if constexpr (kCounts) {
      atomicAdd(&task.first[n_tile], 1ULL);
    } else {
      task.numbers[task.first[n_tile] + atomicAdd(&task.next[n_tile], 1u)] = static_cast<unsigned>(number);
    }
  }
}

}  // namespace

}  // namespace tetwarp::cuda_detail
