// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/claim.cuh"

#include "cuda/runtime/warp.cuh"
#include "deform/core/gather.h"

namespace tetwarp::cuda_detail {

namespace {

/// Cells of a block, and how blocks are numbered.
struct Blocks {
  static constexpr int kX = 32, kY = 4, kZ = 8;

  glm::i64vec3 cells, count;

  explicit Blocks(const DeviceField& field)
      : cells(field.frame.cells), count((cells + glm::i64vec3(kX - 1, kY - 1, kZ - 1)) / glm::i64vec3(kX, kY, kZ)) {}
  __host__ __device__ std::int64_t total() const { return count.x * count.y * count.z; }
  __device__ glm::i64vec3 first_cell(std::int64_t block) const {
    return unravel(block, count) * glm::i64vec3(kX, kY, kZ);
  }
};

/// One thread block a block of cells: the box of its deformed vertices. Threads share out the vertices; each warp finds
/// its box, and atomics in shared memory that of all.
///
/// @param bounds  one for each block of cells, whole voxels: written
__global__ void bounds_kernel(DeviceField field, Blocks blocks, VoxelBounds* bounds) {
  __shared__ int low[3], high[3];
  if (threadIdx.x < 3) {
    low[threadIdx.x] = INT32_MAX;
    high[threadIdx.x] = INT32_MIN;
  }
  __syncthreads();
  const glm::i64vec3 first = blocks.first_cell(blockIdx.x);
  constexpr int kX = Blocks::kX + 1, kY = Blocks::kY + 1, kZ = Blocks::kZ + 1;  // vertices
  Box box{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  for (int n = static_cast<int>(threadIdx.x); n < kX * kY * kZ; n += kThreads) {
    const glm::i64vec3 at = first + glm::i64vec3(n % kX, n / kX % kY, n / (kX * kY));
    if (at.x > blocks.cells.x || at.y > blocks.cells.y || at.z > blocks.cells.z) continue;
    box.grow(field.vertices ? field.vertex(at).deformed : field.steps.deformed(glm::ivec3(at)));
  }
  for (int axis = 0; axis < 3; ++axis) {
    const int least = warp_min(box.low[axis]), most = warp_max(box.high[axis]);
    if (lane_of_warp() == 0) {
      atomicMin(&low[axis], least);
      atomicMax(&high[axis], most);
    }
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  const auto down = [](int steps) { return steps >> kStepBits; };
  const auto up = [](int steps) { return static_cast<int>((std::int64_t{steps} + kStepsPerVoxel - 1) >> kStepBits); };
  bounds[blockIdx.x] = {{down(low[0]), down(low[1]), down(low[2])}, {up(high[0]), up(high[1]), up(high[2])}};
}

/// Lists the blocks that may reach voxels of the slab, or those of them that `only` names; a thread a block.
///
/// @param bounds  of each block, from `bounds_kernel`  @param blocks  how many
/// @param only    a bit for each voxel of the slab, as `BitRows`; null: all
/// @param chosen  numbers of blocks, in any order: written  @param count  their number: 0 before
__global__ void choose_kernel(const VoxelBounds* bounds, std::int64_t blocks, SlabBox slab, const std::uint32_t* only,
                              unsigned* chosen, unsigned* count) {
  const std::int64_t n = thread_of_grid();
  if (n >= blocks) return;
  const glm::i64vec3 low = glm::max(glm::i64vec3(bounds[n].low) - slab.begin, glm::i64vec3(0));
  const glm::i64vec3 high = glm::min(glm::i64vec3(bounds[n].high) - slab.begin, slab.size - std::int64_t{1});
  if (low.x > high.x || low.y > high.y || low.z > high.z) return;
  bool wanted = only == nullptr;
  const std::int64_t words = (slab.size.x + 31) / 32;
  for (std::int64_t z = low.z; z <= high.z && !wanted; ++z) {
    for (std::int64_t y = low.y; y <= high.y && !wanted; ++y) {
      for (std::int64_t word = low.x / 32; word <= high.x / 32; ++word)
        wanted = wanted || only[(z * slab.size.y + y) * words + word] != 0;
    }
  }
  if (wanted) chosen[atomicAdd(count, 1u)] = static_cast<unsigned>(n);
}

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

/// What the cells of a block claim of the voxels that are wanted.
struct WantedSlate {
  StepLattice lattice;
  NudgeTurns turns;
  IntBox region;
  Wanted wanted;
  unsigned long long* owner;  ///< of each wanted voxel, by its number: lowest so far; kNobody before

  __device__ std::int64_t word(const glm::ivec3& in) const {
    const int words = (region.end.x - region.begin.x + 31) / 32;
    return (std::int64_t{in.z} * (region.end.y - region.begin.y) + in.y) * words + in.x / 32;
  }
  /// Whether a cell may reach a wanted voxel.
  __device__ bool may_claim(const glm::ivec3& cell) const {
    Box box{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
#pragma unroll
    for (int corner = 0; corner < 8; ++corner) box.grow(lattice.deformed(cell + corner_of_cell(corner)));
    const IntBox voxels = candidates(turns, box.low, box.high, region);
    if (voxels.is_empty()) return false;
    const glm::ivec3 first = voxels.begin - region.begin, last = voxels.end - region.begin - 1;
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x / 32; x <= last.x / 32; ++x) {
          if ((wanted.bits[word({32 * x, y, z})] & bits_of_word(x, first.x, last.x)) != 0) return true;
        }
      }
    }
    return false;
  }
  __device__ void claim(const glm::ivec3& cell, int t) const {
    const glm::i64vec3 at(cell), cells(lattice.cells);
    const unsigned long long number = TetrahedronNumber::of((at.z * cells.y + at.y) * cells.x + at.x, t);
    visit_tetrahedron(
        lattice, LatticeTetrahedron::of_cell(cell, t), region, turns,
        [&](const glm::ivec3& voxel) {
          const glm::ivec3 in = voxel - region.begin;
          return wanted.has(word(in), in.x & 31);
        },
        [&](const glm::ivec3& voxel) {
          const glm::ivec3 in = voxel - region.begin;
          atomicMin(&owner[wanted.number(word(in), in.x & 31)], number);
        });
  }
};

/// Claims for a lattice with whole steps, with a float test in front of the exact one; for the voxels that are wanted.
/// First the cells of a block that may reach any are listed, then threads share out their tetrahedra, so that all have
/// work.
///
///     shared memory: listed, 1024 x 2 bytes: which cells, as their place in the block, i fastest; found: how many
///
/// @param chosen  numbers of blocks, from `choose_kernel`  @param count  their number, on the device
/// @param slate   its owners are written by atomic minima
__global__ void claim_wanted_kernel(WantedSlate slate, Blocks blocks, const unsigned* chosen, const unsigned* count) {
  constexpr int kCells = Blocks::kX * Blocks::kY * Blocks::kZ;
  __shared__ unsigned short listed[kCells];
  __shared__ unsigned found;
  const auto cell_of = [](int in) {
    return glm::ivec3(in % Blocks::kX, in / Blocks::kX % Blocks::kY, in / (Blocks::kX * Blocks::kY));
  };
  for (unsigned n = blockIdx.x; n < *count; n += gridDim.x) {
    const glm::ivec3 first(blocks.first_cell(chosen[n]));
    if (threadIdx.x == 0) found = 0;
    __syncthreads();
    for (int in = static_cast<int>(threadIdx.x); in < kCells; in += kThreads) {
      const glm::ivec3 cell = first + cell_of(in);
      const glm::ivec3& cells = slate.lattice.cells;
      if (cell.x < cells.x && cell.y < cells.y && cell.z < cells.z && slate.may_claim(cell))
        listed[atomicAdd(&found, 1u)] = static_cast<unsigned short>(in);
    }
    __syncthreads();
    const unsigned tetrahedra = found * kTetrahedraPerCell;
    for (unsigned in = threadIdx.x; in < tetrahedra; in += kThreads)
      slate.claim(first + cell_of(listed[in / kTetrahedraPerCell]), static_cast<int>(in % kTetrahedraPerCell));
    __syncthreads();
  }
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
  claim_wanted_kernel<<<kAtOnce, kThreads, 0, stream>>>(
      {field.steps, NudgeTurns(field.frame.nudge), region, wanted, owner_.data()}, Blocks(field), chosen_.data(),
      count_.data());
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
