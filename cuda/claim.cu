#include "cuda/claim.h"
#include "deform/core/visit_cell.h"

namespace tetwarp::cuda_detail {

namespace {

__global__ void claim_kernel(DeviceField field, SlabBox slab, const std::uint32_t* only, unsigned long long* owner,
                             unsigned* owners) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= field.cell_count()) return;
  const glm::i64vec3 at = field.cell_at(n);
  const VoxelBox region{slab.begin, slab.begin + slab.size};
  const std::int64_t words = (slab.size.x + 31) / 32;
  visit_cell(field.cell(at), DeviceField::is_odd(at), region, field.frame.nudge,
             [&](const glm::i64vec3& voxel, const glm::i32vec3&, int t, const Tetrahedron&) {
               const std::int64_t place = slab.offset(voxel);
               if (only) {
                 const glm::i64vec3 in = voxel - slab.begin;
                 if ((only[(in.z * slab.size.y + in.y) * words + in.x / 32] >> (in.x & 31) & 1) == 0) return;
               }
               atomicMin(&owner[place],
                         static_cast<unsigned long long>(n) * kTetrahedraPerCell + static_cast<unsigned>(t));
               if (owners) atomicAdd(&owners[place], 1u);
             });
}

}  // namespace

void Claims::claim(const DeviceField& field, const SlabBox& slab, const std::uint32_t* only, bool count_owners,
                   cudaStream_t stream) {
  const auto voxels = static_cast<std::size_t>(slab.count());
  owner_.fill(0xFF, voxels, stream);
  if (count_owners) owners_.fill(0, voxels, stream);
  claim_kernel<<<blocks_for(field.cell_count()), kThreads, 0, stream>>>(field, slab, only, owner_.data(),
                                                                        count_owners ? owners_.data() : nullptr);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
