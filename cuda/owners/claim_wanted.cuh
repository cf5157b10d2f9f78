// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/claim_blocks.cuh"
#include "deform/core/cell_faces.h"

/// Claims on some voxels, for a field with whole steps. For claim.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// What the cells of a block claim of the voxels that are wanted.
struct WantedSlate {
  StepLattice lattice;
  NudgeTurns turns;
  IntBox region;
  Wanted wanted;
  unsigned long long* owner;  ///< of each wanted voxel, by its number: lowest so far; kNobody before

  /// Whether the boxes of cells mostly hold few voxels.
  bool has_small_cells() const {
    constexpr float kVoxels = 2;
    const glm::vec3 voxels = lattice.cell * (1.0f / kStepsPerVoxel);
    return voxels.x * voxels.y * voxels.z <= kVoxels;
  }
  __device__ std::int64_t word(const glm::ivec3& in) const {
    const int words = (region.end.x - region.begin.x + 31) / 32;
    return (std::int64_t{in.z} * (region.end.y - region.begin.y) + in.y) * words + in.x / 32;
  }
  __device__ bool wants(const glm::ivec3& voxel) const {
    const glm::ivec3 in = voxel - region.begin;
    return wanted.has(word(in), in.x & 31);
  }
  /// Which of up to 32 voxels of a row are wanted. @param width  1 to 32
  __device__ std::uint32_t wanted_from(const glm::ivec3& voxel, int width) const {
    const glm::ivec3 in = voxel - region.begin;
    const std::uint32_t* words = wanted.bits + word(in);
    const int bit = in.x & 31;
    const std::uint32_t bits = __funnelshift_r(words[0], bit + width > 32 ? words[1] : 0, static_cast<unsigned>(bit));
    return bits & lowest_bits(width);
  }
  __device__ void put(const glm::ivec3& voxel, unsigned long long number) const {
    const glm::ivec3 in = voxel - region.begin;
    atomicMin(&owner[wanted.number(word(in), in.x & 31)], number);
  }
  __device__ unsigned long long number_of(const glm::ivec3& cell, int t) const {
    const glm::i64vec3 at(cell), cells(lattice.cells);
    return TetrahedronNumber::of((at.z * cells.y + at.y) * cells.x + at.x, t);
  }
  /// Whether a tetrahedron owns a voxel, exactly; rarely called.
  __device__ __noinline__ bool owns(LatticeTetrahedron t, glm::ivec3 voxel) const {
    int sides[4];
    return owns_exactly(vertices_of(lattice, t), voxel * kStepsPerVoxel, turns.signs(voxel), sides);
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
    const unsigned long long number = number_of(cell, t);
    visit_tetrahedron(
        lattice, LatticeTetrahedron::of_cell(cell, t), region, turns,
        [&](const glm::ivec3& voxel) { return wants(voxel); }, [&](const glm::ivec3& voxel) { put(voxel, number); });
  }
};

/// Claims for a lattice with whole steps, with a float test in front of the exact one; for the voxels that are wanted,
/// and cells of many voxels. First the cells of a block that may reach any are listed, then threads share out their
/// tetrahedra, so that all have work.
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

/// The boxes of cells that lie one upon another along k. Each plane of vertices is read once.
class CellColumn {
 public:
  /// @param cell  the first
  __device__ CellColumn(const StepLattice& lattice, const glm::ivec3& cell)
      : lattice_(lattice),
        rest_(glm::i32vec3(lattice.first) + cell * glm::i32vec3(lattice.cell)),
        vertex_(static_cast<int>(lattice.offset(cell))),
        last_(static_cast<int>(lattice.offset({cell.x, cell.y, lattice.cells.z}))) {
    read();
    below_ = box_of_plane();
    read();
  }

  /// The box of the next cell, 2^-12 voxel.
  __device__ Box next() {
    const Box above = box_of_plane();
    read();
    Box cell = below_;
    cell.grow(above.low);
    cell.grow(above.high);
    below_ = above;
    return cell;
  }

 private:
  /// Begins to read the four vertices of the next plane, or of the lattice's last one again.
  __device__ void read() {
#pragma unroll
    for (int n = 0; n < 4; ++n) packed_[n] = lattice_.packed[vertex_ + (n & 1) + (n >> 1) * lattice_.row];
    vertex_ += min(lattice_.slice, last_ - vertex_);  // never beyond: there may be 2^31 - 1 vertices
  }
  /// Around the four vertices that were read.
  __device__ Box box_of_plane() {
    const glm::i32vec3 cell(lattice_.cell);
    Box box{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
#pragma unroll
    for (int n = 0; n < 4; ++n)
      box.grow(lattice_.packing.steps(packed_[n]) + glm::i32vec3((n & 1) * cell.x, (n >> 1) * cell.y, 0));
    box.low += rest_;
    box.high += rest_;
    rest_.z += cell.z;
    return box;
  }

  const StepLattice& lattice_;
  glm::i32vec3 rest_;  ///< of the vertex at the corner of the plane that was read, 2^-12 voxel
  int vertex_, last_;  ///< its number on the plane to be read, and on the lattice's last one
  std::uint64_t packed_[4];
  Box below_;
};

/// A cell claims a voxel, if one of its tetrahedra owns it.
__device__ void claim_voxel(const WantedSlate& slate, glm::ivec3 cell, glm::ivec3 voxel) {
  const GatherPoint point(slate.lattice, voxel, slate.turns.signs(voxel));
  const int t = CellFaces(slate.lattice, cell, point).owner([&](int number) {
    return slate.owns(LatticeTetrahedron::of_cell(cell, number), voxel);
  });
  if (t < kTetrahedraPerCell) slate.put(voxel, slate.number_of(cell, t));
}

/// A cell claims all voxels in its box; the lanes of a warp share them out.
__device__ __noinline__ void claim_voxels(const WantedSlate& slate, glm::ivec3 cell, int lane) {
  CellColumn column(slate.lattice, cell);
  const Box box = column.next();
  const IntBox voxels = candidates(slate.turns, box.low, box.high, slate.region);
  const glm::ivec3 size = voxels.end - voxels.begin;
  for (std::int64_t n = lane; n < std::int64_t{size.x} * size.y * size.z; n += 32) {
    const glm::ivec3 voxel = voxels.begin + glm::ivec3(unravel(n, glm::i64vec3(size)));
    if (slate.wants(voxel)) claim_voxel(slate, cell, voxel);
  }
}

/// What a warp has found of 32 x kZ cells: pairs of a cell and a wanted voxel in its box, and the cells for whose pairs
/// there was no room.
struct FoundPairs {
  static constexpr int kRoom = 256, kSlices = Blocks::kZ;
  struct Pair {
    int cell;  ///< packed
    glm::ivec3 voxel;

    using Lane = BitField<0, 5, int>;
    using Slice = BitField<Lane::kEnd, 3, int>;
    static_assert(Slice::kMost + 1 == kSlices);
  };

  Pair pairs[kRoom];
  unsigned crowded[kSlices];  ///< a bit for each cell of a row

  /// Adds a pair of every lane that has one; called by the whole warp.
  /// @param count  of pairs, the same in all lanes: grows
  /// @return false in lanes whose pair finds no room
  __device__ bool add(bool has, int lane, int slice, const glm::ivec3& voxel, int& count) {
    const unsigned votes = __ballot_sync(kAllLanes, has);
    const int place = count + rank_among(votes, lane);
    if (has && place < kRoom) pairs[place] = {Pair::Lane::put(lane) | Pair::Slice::put(slice), voxel};
    count = min(count + __popc(votes), kRoom);
    return !has || place < kRoom;
  }
};

/// The same as `claim_wanted_kernel`, for cells of about a voxel, whose boxes hold few: then it costs less to test a
/// voxel against all of a cell than to prepare every tetrahedron. A warp goes along k with a row of cells and lists the
/// pairs of a cell and a voxel in its box; then each lane takes pair after pair. The voxels of cells for whose pairs
/// there is no room are shared out among the lanes.
///
///     shared memory: `FoundPairs`, a warp
///
/// @param chosen, count, slate  as those of `claim_wanted_kernel`
__global__ void __launch_bounds__(kThreads, 8)
    claim_pairs_kernel(const __grid_constant__ WantedSlate slate, const __grid_constant__ Blocks blocks,
                       const unsigned* chosen, const unsigned* count) {
  static_assert(Blocks::kX == 32 && Blocks::kY * Blocks::kX == kThreads);
  __shared__ FoundPairs found_by[Blocks::kY];
  const int lane = lane_of_warp(), warp = static_cast<int>(threadIdx.x / 32);
  const glm::ivec3& cells = slate.lattice.cells;
  FoundPairs& found = found_by[warp];
  for (unsigned n = blockIdx.x; n < *count; n += gridDim.x) {
    const glm::ivec3 first = glm::ivec3(blocks.first_cell(chosen[n])) + glm::ivec3(0, warp, 0);
    if (first.y >= cells.y) continue;  // the whole warp
    const bool here = first.x + lane < cells.x;
    const int slices = min(Blocks::kZ, cells.z - first.z);
    CellColumn column(slate.lattice, {min(first.x + lane, cells.x - 1), first.y, first.z});
    int pairs = 0;
    for (int slice = 0; slice < slices; ++slice) {
      const Box box = column.next();
      const IntBox voxels = candidates(slate.turns, box.low, box.high, slate.region);
      glm::ivec3 voxel = voxels.begin;
      bool more = here && !voxels.is_empty(), crowded = false;
      while (__any_sync(kAllLanes, more && !crowded)) {  // part of a row after part of a row
        std::uint32_t bits = more && !crowded ? slate.wanted_from(voxel, min(voxels.end.x - voxel.x, 32)) : 0;
        for (; __any_sync(kAllLanes, bits != 0); bits &= bits - 1) {
          const bool has = bits != 0;
          if (!found.add(has, lane, slice, voxel + glm::ivec3(has ? first_bit(bits) : 0, 0, 0), pairs)) crowded = true;
        }
        voxel.x += 32;
        if (voxel.x < voxels.end.x) continue;
        voxel.x = voxels.begin.x;
        if (++voxel.y < voxels.end.y) continue;
        voxel.y = voxels.begin.y;
        more = more && ++voxel.z < voxels.end.z;
      }
      found.crowded[slice] = __ballot_sync(kAllLanes, crowded);
    }
    __syncwarp();
    for (int m = lane; m < pairs; m += 32) {
      const FoundPairs::Pair pair = found.pairs[m];
      const glm::ivec3 in(FoundPairs::Pair::Lane::get(pair.cell), 0, FoundPairs::Pair::Slice::get(pair.cell));
      claim_voxel(slate, first + in, pair.voxel);
    }
    for (int slice = 0; slice < slices; ++slice) {
      for (unsigned left = found.crowded[slice]; left != 0; left &= left - 1)
        claim_voxels(slate, first + glm::ivec3(first_bit(left), 0, slice), lane);
    }
    __syncwarp();
  }
}

}  // namespace

}  // namespace tetwarp::cuda_detail
