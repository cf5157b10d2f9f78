// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.cuh"
#include "cuda/runtime/bits.cuh"

namespace tetwarp::cuda_detail {

/// Box of voxels that the cells of a block may reach, both ends included.
struct VoxelBounds {
  glm::ivec3 low, high;
};

/// A subset of the voxels of a box, numbered word by word.
///
///     bits   ...0110 0001   0000...   1000 0000        as `BitRows`
///     rank           k       (any)    k + 3            number of the lowest voxel of the word
struct Wanted {
  const std::uint32_t* bits;  ///< one bit for each voxel; each row begins at a word
  const unsigned* rank;       ///< number of the first voxel of each word that contains any; from `number_kernel`

  __device__ bool has(std::int64_t word, int bit) const { return (bits[word] >> bit & 1) != 0; }
  __device__ unsigned number(std::int64_t word, int bit) const {
    return rank[word] + static_cast<unsigned>(__popc(bits[word] & bits_below(bit)));
  }
};

/// Finds owners by scatter, for any field: every cell claims its voxels, and the lowest number wins, whatever the
/// order.
class Claims {
 public:
  /// Bytes for each voxel of a slab.
  static constexpr std::int64_t kBytes = sizeof(unsigned long long) + sizeof(unsigned);

  /// To be called when the field changes.
  void forget_field() { has_bounds_ = false; }

  /// Finds the owners of all voxels of a slab.
  void claim(const DeviceField& field, const SlabBox& slab, bool count_owners, cudaStream_t stream);
  /// Finds the owners of some voxels of a slab, for a field with whole steps.
  /// @param count  number of these voxels
  void claim(const DeviceField& field, const SlabBox& slab, const Wanted& wanted, std::size_t count,
             cudaStream_t stream);

  /// Lowest number of a tetrahedron that owns the voxel, or kNobody: one for each voxel of the slab, or at the index
  /// that `Wanted::rank` gives.
  const unsigned long long* owner() const { return owner_.data(); }
  /// Number of owners, if they were counted.
  const unsigned* owners() const { return owners_.data(); }

 private:
  void choose(const DeviceField& field, const SlabBox& slab, const std::uint32_t* only, cudaStream_t stream);

  bool has_bounds_ = false;
  DeviceBuffer<VoxelBounds> bounds_;  ///< of each block of cells
  /// Blocks that may reach the slab, and their number.
  DeviceBuffer<unsigned> chosen_, count_;
  DeviceBuffer<unsigned long long> owner_;
  DeviceBuffer<unsigned> owners_;
};

/// What stands for no owner: larger than any number, so that an atomic minimum replaces it.
constexpr unsigned long long kNobody = ~0ULL;

/// Numbers of the tetrahedra of a lattice: five a cell, cells i fastest (docs/design/definition.md). 64 bits hold them
/// for any lattice.
struct TetrahedronNumber {
  __device__ static unsigned long long of(std::int64_t cell, int t) {
    return static_cast<unsigned long long>(cell * kTetrahedraPerCell + t);
  }
  __device__ static unsigned long long cell(unsigned long long number) { return number / kTetrahedraPerCell; }
  __device__ static int in_cell(unsigned long long number) { return static_cast<int>(number % kTetrahedraPerCell); }
};

/// The tetrahedron with a number.
__device__ inline Tetrahedron tetrahedron_numbered(const DeviceField& field, unsigned long long number) {
  const glm::i64vec3 at = field.cell_at(static_cast<std::int64_t>(TetrahedronNumber::cell(number)));
  return tetrahedron_of(field.cell(at), TetrahedronNumber::in_cell(number), DeviceField::is_odd(at));
}

}  // namespace tetwarp::cuda_detail
