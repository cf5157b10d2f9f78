// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/claim.cuh"

#include "cuda/owners/claim_wanted.cuh"

namespace tetwarp::cuda_detail {

namespace {

/// The claims on all voxels of a slab, in the order of the voxels.
struct Slate {
  SlabBox slab;
  unsigned long long* owner;  ///< lowest number so far; kNobody before
  unsigned* owners;           ///< how many claimed it, 0 before; or null

  __device__ Region region() const { return {slab.begin, slab.begin + slab.size}; }
  __device__ void claim(const glm::i64vec3& voxel, unsigned long long number) const {
    const std::int64_t n = slab.offset(voxel);
    atomicMin(&owner[n], number);
    if (owners) atomicAdd(&owners[n], 1u);
  }
};

/// Calls `visit(cell, number of its first tetrahedron)` for the cells of the chosen blocks.
template <class Visit>
__device__ void for_each_chosen(const Blocks& blocks, const unsigned* chosen, unsigned count, Visit&& visit) {
  for (unsigned n = blockIdx.x; n < count; n += gridDim.x) {
    const glm::i64vec3 first = blocks.first_cell(chosen[n]);
    for (int in = static_cast<int>(threadIdx.x); in < Blocks::kX * Blocks::kY * Blocks::kZ; in += kThreads) {
      const glm::i64vec3 at =
          first + glm::i64vec3(in % Blocks::kX, in / Blocks::kX % Blocks::kY, in / (Blocks::kX * Blocks::kY));
      if (at.x >= blocks.cells.x || at.y >= blocks.cells.y || at.z >= blocks.cells.z) continue;
      visit(at, TetrahedronNumber::of((at.z * blocks.cells.y + at.y) * blocks.cells.x + at.x, 0));
    }
  }
}

/// Every cell of the chosen blocks claims the voxels that its tetrahedra own, by `visit_cell`. Thread blocks take block
/// after block of cells, threads cell after cell.
///
/// @param chosen  numbers of blocks, from `choose_kernel`  @param count  their number, on the device
/// @param slate   its voxels are written by atomic minima, so the order of threads does not matter
__global__ void claim_kernel(DeviceField field, Blocks blocks, const unsigned* chosen, const unsigned* count,
                             Slate slate) {
  for_each_chosen(blocks, chosen, *count, [&](const glm::i64vec3& at, unsigned long long number) {
    visit_cell(field.cell(at), DeviceField::is_odd(at), slate.region(), field.frame.nudge,
               [&](const glm::i64vec3& voxel, const glm::i32vec3&, int t, const Tetrahedron&) {
                 slate.claim(voxel, number + static_cast<unsigned>(t));
               });
  });
}

constexpr unsigned kAtOnce = 4096;  ///< thread blocks; each takes block after block

}  // namespace

void Claims::choose(const DeviceField& field, const SlabBox& slab, const std::uint32_t* only, cudaStream_t stream) {
  const Blocks blocks(field);
  if (!has_bounds_) {
    VoxelBounds* bounds = bounds_.reserve(static_cast<std::size_t>(blocks.total()));
    chosen_.reserve(static_cast<std::size_t>(blocks.total()));
    bounds_kernel<<<static_cast<unsigned>(blocks.total()), kThreads, 0, stream>>>(field, blocks, bounds);
    has_bounds_ = true;
  }
  count_.fill(0, 1, stream);
  choose_kernel<<<blocks_for(blocks.total()), kThreads, 0, stream>>>(bounds_.data(), blocks.total(), slab, only,
                                                                     chosen_.data(), count_.data());
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void Claims::claim(const DeviceField& field, const SlabBox& slab, bool count_owners, cudaStream_t stream) {
  const auto voxels = static_cast<std::size_t>(slab.count());
  owner_.fill(0xFF, voxels, stream);
  if (count_owners) owners_.fill(0, voxels, stream);
  choose(field, slab, nullptr, stream);
  const Slate slate{slab, owner_.data(), count_owners ? owners_.data() : nullptr};
  claim_kernel<<<kAtOnce, kThreads, 0, stream>>>(field, Blocks(field), chosen_.data(), count_.data(), slate);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void Claims::claim(const DeviceField& field, const SlabBox& slab, const Wanted& wanted, std::size_t count,
                   cudaStream_t stream) {
  owner_.fill(0xFF, count, stream);
  choose(field, slab, wanted.bits, stream);
  const IntBox region{glm::ivec3(slab.begin), glm::ivec3(slab.begin + slab.size)};
  const WantedSlate slate{field.steps, NudgeTurns(field.frame.nudge), region, wanted, owner_.data()};
  const auto kernel = slate.has_small_cells() ? claim_pairs_kernel : claim_wanted_kernel;
  kernel<<<kAtOnce, kThreads, 0, stream>>>(slate, Blocks(field), chosen_.data(), count_.data());
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
