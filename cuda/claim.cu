#include "cuda/claim.h"
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

/// One thread block a block of cells: the box of its deformed vertices.
__global__ void bounds_kernel(DeviceField field, Blocks blocks, VoxelBounds* bounds) {
  __shared__ int low[3], high[3];
  if (threadIdx.x < 3) {
    low[threadIdx.x] = INT32_MAX;
    high[threadIdx.x] = INT32_MIN;
  }
  __syncthreads();
  const glm::i64vec3 first = blocks.first_cell(blockIdx.x);
  const glm::ivec3 size =
      glm::ivec3(glm::min(glm::i64vec3(Blocks::kX, Blocks::kY, Blocks::kZ), blocks.cells - first)) + 1;
  Box box{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  for (int n = static_cast<int>(threadIdx.x); n < size.x * size.y * size.z; n += kThreads)
    box.grow(field.vertex(first + glm::i64vec3(n % size.x, n / size.x % size.y, n / (size.x * size.y))).deformed);
  for (int axis = 0; axis < 3; ++axis) {
    int least = box.low[axis], most = box.high[axis];
    for (int step = 16; step > 0; step /= 2) {
      least = min(least, __shfl_xor_sync(~0u, least, step));
      most = max(most, __shfl_xor_sync(~0u, most, step));
    }
    if ((threadIdx.x & 31) == 0) {
      atomicMin(&low[axis], least);
      atomicMax(&high[axis], most);
    }
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  const auto up = [](int steps) { return static_cast<int>((std::int64_t{steps} + kStepsPerVoxel - 1) >> 12); };
  bounds[blockIdx.x] = {{low[0] >> 12, low[1] >> 12, low[2] >> 12}, {up(high[0]), up(high[1]), up(high[2])}};
}

/// Lists the blocks that may reach voxels of the slab, or those of them that `only` names.
__global__ void choose_kernel(const VoxelBounds* bounds, std::int64_t blocks, SlabBox slab, const std::uint32_t* only,
                              unsigned* chosen, unsigned* count) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
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

/// One thread 32 voxels: nobody owns those that are asked for yet.
__global__ void clear_kernel(SlabBox slab, const std::uint32_t* only, unsigned long long* owner) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  const std::int64_t words = (slab.size.x + 31) / 32;
  if (n >= words * slab.size.y * slab.size.z) return;
  for (std::uint32_t left = only[n]; left != 0; left &= left - 1)
    owner[n / words * slab.size.x + n % words * 32 + __ffs(static_cast<int>(left)) - 1] = kNobody;
}

/// The claims on the voxels of a slab.
struct Slate {
  SlabBox slab;
  const std::uint32_t* only;
  unsigned long long* owner;
  unsigned* owners;

  __device__ VoxelBox region() const { return {slab.begin, slab.begin + slab.size}; }
  __device__ void claim(const glm::i64vec3& voxel, unsigned long long number) const {
    const glm::i64vec3 at = voxel - slab.begin;
    const std::int64_t row = at.z * slab.size.y + at.y;
    if (only && (only[row * ((slab.size.x + 31) / 32) + at.x / 32] >> (at.x & 31) & 1) == 0) return;
    atomicMin(&owner[row * slab.size.x + at.x], number);
    if (owners) atomicAdd(&owners[row * slab.size.x + at.x], 1u);
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
      visit(at, static_cast<unsigned long long>((at.z * blocks.cells.y + at.y) * blocks.cells.x + at.x) *
                    kTetrahedraPerCell);
    }
  }
}

__global__ void claim_kernel(DeviceField field, Blocks blocks, const unsigned* chosen, const unsigned* count,
                             Slate slate) {
  for_each_chosen(blocks, chosen, *count, [&](const glm::i64vec3& at, unsigned long long number) {
    visit_cell(field.cell(at), DeviceField::is_odd(at), slate.region(), field.frame.nudge,
               [&](const glm::i64vec3& voxel, const glm::i32vec3&, int t, const Tetrahedron&) {
                 slate.claim(voxel, number + static_cast<unsigned>(t));
               });
  });
}

/// The same for whole steps, with a float test in front of the exact one.
__global__ void claim_steps_kernel(StepLattice lattice, Nudge nudge, Blocks blocks, const unsigned* chosen,
                                   const unsigned* count, Slate slate) {
  for_each_chosen(blocks, chosen, *count, [&](const glm::i64vec3& at, unsigned long long number) {
#pragma unroll 1
    for (int t = 0; t < kTetrahedraPerCell; ++t) {
      visit_tetrahedron(
          lattice, LatticeTetrahedron::of_cell(glm::ivec3(at), t), slate.region(), nudge,
          [&](const glm::ivec3& voxel) { slate.claim(glm::i64vec3(voxel), number + static_cast<unsigned>(t)); });
    }
  });
}

}  // namespace

void Claims::find_bounds(const DeviceField& field, cudaStream_t stream) {
  if (has_bounds_) return;
  const Blocks blocks(field);
  VoxelBounds* bounds = bounds_.reserve(static_cast<std::size_t>(blocks.total()));
  chosen_.reserve(static_cast<std::size_t>(blocks.total()));
  bounds_kernel<<<static_cast<unsigned>(blocks.total()), kThreads, 0, stream>>>(field, blocks, bounds);
  TETWARP_CUDA_TRY(cudaGetLastError());
  has_bounds_ = true;
}

void Claims::claim(const DeviceField& field, const SlabBox& slab, const std::uint32_t* only, bool count_owners,
                   cudaStream_t stream) {
  constexpr unsigned kAtOnce = 4096;  // thread blocks; each takes block after block
  find_bounds(field, stream);
  const auto voxels = static_cast<std::size_t>(slab.count());
  if (only) {
    owner_.reserve(voxels);
    clear_kernel<<<blocks_for((slab.size.x + 31) / 32 * slab.size.y * slab.size.z), kThreads, 0, stream>>>(
        slab, only, owner_.data());
  } else {
    owner_.fill(0xFF, voxels, stream);
  }
  if (count_owners) owners_.fill(0, voxels, stream);
  count_.fill(0, 1, stream);
  const Blocks blocks(field);
  choose_kernel<<<blocks_for(blocks.total()), kThreads, 0, stream>>>(bounds_.data(), blocks.total(), slab, only,
                                                                     chosen_.data(), count_.data());
  const Slate slate{slab, only, owner_.data(), count_owners ? owners_.data() : nullptr};
  if (field.has_steps()) {
    claim_steps_kernel<<<kAtOnce, kThreads, 0, stream>>>(field.steps, field.frame.nudge, blocks, chosen_.data(),
                                                         count_.data(), slate);
  } else {
    claim_kernel<<<kAtOnce, kThreads, 0, stream>>>(field, blocks, chosen_.data(), count_.data(), slate);
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
