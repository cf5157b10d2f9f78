#pragma once

#include "cuda/slab.h"

namespace tetwarp::cuda_detail {

/// Box of voxels that the cells of a block may reach, both ends included.
struct VoxelBounds {
  glm::ivec3 low, high;
};

/// The plain way, for any field: every cell claims its voxels, and the lowest number wins, whatever the order.
class Claims {
 public:
  /// To be called when the field is another one.
  void forget_field() { has_bounds_ = false; }

  /// Who owns the voxels of a slab. @param only  one bit a voxel, rows from a word on: those alone; or null
  void claim(const DeviceField& field, const SlabBox& slab, const std::uint32_t* only, bool count_owners,
             cudaStream_t stream);

  /// Lowest number of a tetrahedron that owns the voxel, or kNobody; where `only` allowed.
  const unsigned long long* owner() const { return owner_.data(); }
  /// How many do; where asked for.
  const unsigned* owners() const { return owners_.data(); }

 private:
  void find_bounds(const DeviceField& field, cudaStream_t stream);

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
