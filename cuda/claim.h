#pragma once

#include "cuda/slab.h"

namespace tetwarp::cuda_detail {

/// The plain way, for any field: every cell claims its voxels, and the lowest number wins, whatever the order.
class Claims {
 public:
  /// Who owns the voxels of a slab. @param only  one bit a voxel, rows from a word on: claim those alone; or null
  void claim(const DeviceField& field, const SlabBox& slab, const std::uint32_t* only, bool count_owners,
             cudaStream_t stream);

  /// Lowest number of a tetrahedron that owns the voxel, or ~0.
  const unsigned long long* owner() const { return owner_.data(); }
  /// How many do; where asked for.
  const unsigned* owners() const { return owners_.data(); }

 private:
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
