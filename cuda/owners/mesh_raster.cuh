// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.cuh"
#include "cuda/owners/interval_raster.cuh"
#include "deform/snapped_mesh.h"

namespace tetwarp::cuda_detail {

/// Counts the voxels that nobody owns.
struct HoleSink {
  SlabBox box;
  unsigned long long* found;  ///< two numbers: how many there are, and the index of the first in the box

  __device__ int address(const glm::ivec3& voxel) const { return static_cast<int>(box.offset(glm::i64vec3(voxel))); }
  __device__ int per_slice() const { return static_cast<int>(box.size.x * box.size.y); }
  __device__ void nothing(int address) const {
    atomicAdd(&found[0], 1ULL);
    if (static_cast<unsigned long long>(address) < found[1])
      atomicMin(&found[1], static_cast<unsigned long long>(address));
  }
};

/// A mesh on the device, and lists of the tetrahedra that may reach each tile of the output. Tile by tile they are
/// rasterised, each row an interval (deform/core/row_interval.h), and the lowest number wins. Tiles of coarse fields
/// with short lists go the way of lattices (interval_kernel.cuh).
class MeshRaster {
 public:
  /// Device memory of a mesh, without the lists.
  static std::uint64_t bytes_of(const SnappedMesh& mesh);
  /// Uploads the mesh and lists its tetrahedra. Waits for the stream.
  void set(const SnappedMesh& mesh, const Geometry& output, cudaStream_t stream);

  /// Finds the voxels of a box, fewer than 2^31, and gives them to a sink. Queued on the stream.
  template <class Sink>
  void run(const SlabBox& box, const Sink& sink, cudaStream_t stream);
  /// Of the last run with a sink of voxels: how many were covered. Waits for the stream.
  std::uint64_t covered(cudaStream_t stream);

  /// For a kernel: the tetrahedron with a number.
  struct View {
    const Vertex* vertices;
    const glm::u32vec4* tetrahedra;
    Nudge nudge;

    __device__ Tetrahedron tetrahedron(unsigned number) const {
      const glm::u32vec4 at = tetrahedra[number];
      return {vertices[at.x], vertices[at.y], vertices[at.z], vertices[at.w]};
    }
  };
  View view() const { return {vertices_.data(), tetrahedra_.data(), nudge_}; }
  /// Device memory that is held.
  std::uint64_t held_bytes() const;

 private:
  glm::ivec3 size_{0};               ///< of the output
  glm::ivec3 origin_{0}, tiles_{0};  ///< first voxel of the first tile, and how many; the nudge turns between tiles
  unsigned count_ = 0;               ///< tetrahedra
  Nudge nudge_;
  DeviceBuffer<Vertex> vertices_;
  DeviceBuffer<glm::u32vec4> tetrahedra_;
  DeviceBuffer<unsigned long long> first_;  ///< of each tile, i fastest, and of one more: where its list begins
  DeviceBuffer<unsigned> next_, numbers_;
  DeviceBuffer<unsigned long long> longest_;  ///< how many the longest list has
  DeviceBuffer<std::byte> scan_;
  DeviceBuffer<int4> records_;   ///< of all tetrahedra (tetrahedron_records.cuh), where there are any
  bool has_records_ = false;     ///< of a coarse field whose records do not take too much memory
  bool has_long_lists_ = false;  ///< whether some have no room in a tile of interval_kernel.cuh
  DeviceBuffer<TileCounters> counters_;
  PinnedBuffer<TileCounters> found_;
};

}  // namespace tetwarp::cuda_detail
