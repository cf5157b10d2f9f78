// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.h"

namespace tetwarp::cuda_detail {

/// Box of voxels that the cells of a block may reach, both ends included.
struct VoxelBounds {
  glm::ivec3 low, high;
};

/// Some voxels of a box, numbered as they came.
struct Wanted {
  const std::uint32_t* bits;  ///< one a voxel, rows from a word on
  const unsigned* rank;       ///< number of the first voxel of a word, where that has any

  __device__ bool has(std::int64_t word, int bit) const { return (bits[word] >> bit & 1) != 0; }
  __device__ unsigned number(std::int64_t word, int bit) const {
    return rank[word] + static_cast<unsigned>(__popc(bits[word] & ((1u << bit) - 1)));
  }
};

/// The plain way, for any field: every cell claims its voxels, and the lowest number wins, whatever the order.
class Claims {
 public:
  static constexpr std::int64_t kBytes = sizeof(unsigned long long) + sizeof(unsigned);  ///< of a voxel of a slab

  /// To be called when the field is another one.
  void forget_field() { has_bounds_ = false; }

  /// Who owns the voxels of a slab.
  void claim(const DeviceField& field, const SlabBox& slab, bool count_owners, cudaStream_t stream);
  /// Who owns some of them, for a field with whole steps. @param count  how many these are
  void claim(const DeviceField& field, const SlabBox& slab, const Wanted& wanted, std::size_t count,
             cudaStream_t stream);

  /// Lowest number of a tetrahedron that owns the voxel, or kNobody: of each voxel of the slab, or by its
  /// `Wanted::rank`.
  const unsigned long long* owner() const { return owner_.data(); }
  /// How many do; where asked for.
  const unsigned* owners() const { return owners_.data(); }

 private:
  void choose(const DeviceField& field, const SlabBox& slab, const std::uint32_t* only, cudaStream_t stream);

  bool has_bounds_ = false;
  DeviceBuffer<VoxelBounds> bounds_;       ///< of blocks of cells
  DeviceBuffer<unsigned> chosen_, count_;  ///< blocks that may reach the slab, and how many
  DeviceBuffer<unsigned long long> owner_;
  DeviceBuffer<unsigned> owners_;
};

constexpr unsigned long long kNobody = ~0ULL;

/// The tetrahedron with a number.
__device__ inline Tetrahedron tetrahedron_numbered(const DeviceField& field, unsigned long long number) {
  const glm::i64vec3 at = field.cell_at(static_cast<std::int64_t>(number / kTetrahedraPerCell));
  return tetrahedron_of(field.cell(at), static_cast<int>(number % kTetrahedraPerCell), DeviceField::is_odd(at));
}

}  // namespace tetwarp::cuda_detail
