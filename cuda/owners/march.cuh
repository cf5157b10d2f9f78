// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/voxel_sink.cuh"
#include "cuda/owners/map_table.cuh"
#include "cuda/owners/warp_queue.cuh"

/// The march of a gather: the kernel that goes along k. For gather.cu alone.
namespace tetwarp::cuda_detail {

namespace {

constexpr int kBlocks = 6;     ///< a multiprocessor
constexpr int kCopied = 16;    ///< voxels of a lane that are on their way together
constexpr int kRounds = 10;    ///< at the first slice of a march, while guesses fail
constexpr int kFewFailed = 3;  ///< lanes

/// Keeps the compiler from computing a value again at every use.
__device__ void keep(float& value) { asm volatile("" : "+f"(value)); }

/// Asks for a vertex two slices on, near which a march will be.
__device__ inline void prefetch(const StepLattice& lattice, const FloatTetrahedron& t) {
  const auto slice = static_cast<unsigned>(lattice.slice), last = slice * static_cast<unsigned>(lattice.cells.z);
  const std::uint64_t* vertex = lattice.packed + min(static_cast<unsigned>(t.offset) + 2 * slice, last);
  asm volatile("prefetch.global.L2 [%0];" ::"l"(vertex));
}

/// One warp at work: kAlongI voxels along i, kAlongJ along j, up to kMarch along k.
/// @tparam kTable  whether `GatherTask::maps` has the maps of a coarse field; else they are made voxel by voxel
template <class Sink, bool kTable>
struct March {
  static constexpr bool kCoarse = kIsCoarse<Sink>;
  static constexpr Effort kEffort = kCoarse ? Effort::close : Effort::quick;

  const GatherTask& task;
  const Sink& sink;
  glm::ivec3 first;  ///< voxel of lane 0 in the box
  int lane, slices;
  bool in_box;  ///< whether this lane has voxels

  __device__ glm::ivec3 voxel(int n) const { return first + task.begin() + of_lane(lane) + glm::ivec3(0, 0, n); }

  /// Which voxels of this lane have one owner: bit n for slice `from` + n.
  ///
  /// Lane n reads what all lanes want of slice `from` + n, 16 bits of each of two rows, and the bits are transposed:
  ///
  ///     bit       31 ........... 16 15 ............ 0                       bit n of lane m:
  ///     lane n    voxels of row j+1 | voxels of row j     of slice n   ->   lane m's voxel in slice n
  __device__ std::uint32_t read_singles(int from) const {
    const int n = from + lane;
    std::uint32_t bits = 0;
    if (n < slices) {
#pragma unroll
      for (int j = 0; j < kAlongJ; ++j) {
        if (first.y + j >= task.size().y) break;
        const std::uint32_t word = task.single.words[task.word({first.x, first.y + j, first.z + n})];
        bits |= (word >> first.x % 32 & lowest_bits(kAlongI)) << j * kAlongI;
      }
    }
    return transposed(bits, lane);
  }

  /// Voxels of cells at rest are copied. @return how many of this lane are covered
  __device__ int copy() const {
    int covered = 0;
    for (int from = 0; from < slices; from += 32) {
      const int end = min(slices, from + 32);
      const std::uint32_t singles = read_singles(from);
      if (in_box) clear(from, end, singles);
      covered += __popc(singles);
      for (int n = from; n < end; n += kCopied) sink.template copy<kCopied>(voxel(n), singles >> (n - from));
    }
    return covered;
  }

  /// Predicts the owner of each voxel from that of the one before. @param place  guess for the first
  __device__ int predict(glm::vec3 place, WarpQueue<Sink> queue) const {
    const int turn = task.nudge.first_down.z - voxel(0).z;  // where the nudge along k turns
    int covered = 0, rounds = 0;
    for (int n = 0; n < slices;) {  // little of a run lives on while the queue is drained
      const std::uint32_t singles = read_singles(n & ~31);
      int end = min(slices, (n & ~31) + 32);
      if (n % 32 == 0 && in_box) clear(n, end, singles);
      if (n < turn) end = min(end, turn);
      covered += run(n, end, singles >> (n & 31), rounds, place, queue);
      while (queue.waiting >= 32) covered += static_cast<int>(queue.drain(task, sink));
    }
    while (queue.waiting > 0) covered += static_cast<int>(queue.drain(task, sink));
    return covered;
  }

  /// What has no owner, or several.
  __device__ void clear(int n, int end, std::uint32_t singles) const {
    for (std::uint32_t left = ~singles & lowest_bits(end - n); left != 0; left &= left - 1)
      sink.nothing(sink.address(voxel(n + first_bit(left))));
  }

  /// U of a voxel of a coarse field that a tetrahedron owns.
  __device__ FixedU fixed_u(const FloatTetrahedron& t, const LocalTetrahedron& local, const glm::ivec3& at) const {
    const glm::i32vec3 d = glm::i32vec3(task.lattice.first) + glm::i32vec3(t.d) * glm::i32vec3(task.lattice.cell) +
                           glm::i32vec3(local.moved);
    const CoarseMap map(glm::dvec3(local.a), glm::dvec3(local.b), glm::dvec3(local.c), d, glm::dvec3(-local.moved),
                        glm::dvec3(-local.moved_a), glm::dvec3(-local.moved_b), glm::dvec3(-local.moved_c));
    const glm::i64vec3 u = map.u(at);
    const glm::i32vec3 low(u);
    return {low, !map.is_thin && glm::i64vec3(low) == u};
  }

  /// From slice n to slice `end`, or until the queue holds a warp full: then n is where to go on.
  /// @param singles  which voxels of this lane have one owner, from the lowest bit on
  /// @return how many of this lane are covered
  __device__ int run(int& n, int end, std::uint32_t singles, int& rounds, glm::vec3& place,
                     WarpQueue<Sink>& queue) const {
    glm::ivec3 at = voxel(n);
    const int out_slice = sink.per_slice();
    int out = sink.address(at) - out_slice, failures = 0;
    GatherPoint point = task.point(at);
    keep(point.steps.x);
    keep(point.steps.y);
    keep(point.nudge.x);
    keep(point.nudge.y);
    keep(point.nudge.z);
    const std::uint32_t wanted = singles;
    const int begin = n;
    typename Sink::Pending pending{};
    do {
      const FloatTetrahedron t = tetrahedron_at(task.lattice, place);
      const LocalTetrahedron local(task.lattice, t, point);
      TableMap map;
      if constexpr (kTable) map = read_map(task.maps, t);
      if (!kCoarse) prefetch(task.lattice, t);
      sink.finish(out, pending);
      out += out_slice;
      const Trial trial = try_tetrahedron<kEffort>(t, local, point);
      const bool single = (singles & 1) != 0;
      if constexpr (kCoarse) {
        const FixedU u = kTable ? map.u(at) : fixed_u(t, local, at);
        sink.start(out, at, u, single & trial.owns & u.any, pending);
      } else {
        sink.start(out, at, trial.moved, single & trial.owns, pending);
      }
      const bool again = single & !pending.any;
      const unsigned failed = __ballot_sync(kAllLanes, again);
      if (failed != 0) {
        const bool lost = single & !trial.owns;
        if (n == 0 && rounds < kRounds &&
            __popc(__ballot_sync(kAllLanes, lost)) > kFewFailed) {  // no good seed: once more
          const glm::vec3 better = rounds++ < 3 ? trial.place() : (place + trial.place()) * 0.5f;
          if (lost) place = better;
          pending.any = false;
          out -= out_slice;
          continue;
        }
        queue.push(failed, queue.word_of(lane, n), trial.place());
        failures += again;
        if (queue.waiting >= 32) end = n + 1;
      }
      place = trial.next_place();
      point.steps.z += float{kStepsPerVoxel};
      ++at.z;
      singles >>= 1;
      ++n;
    } while (n < end);
    sink.finish(out, pending);
    return __popc(wanted & lowest_bits(n - begin)) - failures;
  }
};

/// Finds and samples the voxels of a box that have one owner: copied where a march is at rest, else predicted one from
/// another along k. Grid (blocks along i, along j, marches along k), block (32 lanes, kWarps warps), a march a warp.
///
///     shared memory: 64 voxels of 16 bytes a warp, `WarpQueue`
///
/// @param task   `counters->covered` is added to; voxels that are left go to the queue
/// @param seeds  from `seed_kernel`  @param sink  gets every voxel but those that are left
template <class Sink, bool kTable>
__global__ void __launch_bounds__(32 * kWarps, Sink::kIsWide ? kBlocks - 1 : kBlocks)
    march_kernel(const __grid_constant__ GatherTask task, const glm::vec3* seeds, const __grid_constant__ Sink sink) {
  __shared__ typename WarpQueue<Sink>::WaitingVoxel voxels[kWarps][64];
  const int lane = static_cast<int>(threadIdx.x), warp = static_cast<int>(threadIdx.y);
  const glm::ivec3 size = task.size(),
                   march_at(blockIdx.x * kAcross + warp % kAcross, blockIdx.y * (kWarps / kAcross) + warp / kAcross,
                            blockIdx.z),
                   first = march_at * glm::ivec3(kAlongI, kAlongJ, kMarch);
  if (first.x >= size.x || first.y >= size.y) return;  // the whole warp
  const glm::ivec3 begin = first + of_lane(lane), inside = glm::min(begin, size - 1);
  const March<Sink, kTable> march{task, sink, first, lane, min(kMarch, size.z - first.z), begin == inside};
  int found = 0;
  if (task.resting[task.march_number(march_at)] != 0) {
    found = march.copy();
  } else {
    const glm::ivec3 seed(inside.x / kSeedTile, inside.y / kSeedTile, blockIdx.z);
    const glm::vec3 place = seeds[(seed.z * task.seeds.y + seed.y) * task.seeds.x + seed.x] +
                            glm::vec3(begin - task.seeded(seed)) * task.lattice.voxel;
    found = march.predict(place, {voxels[warp], first, lane});
  }
  // Not `warp_add`, that is CUB's sum: 40 to 90 instructions less and the same registers, but 8 bytes more of stack in
  // the kernel for volumes of any types.
  const unsigned covered = group_sum(static_cast<unsigned>(found), 32);
  if (lane == 0 && covered != 0) atomicAdd(&task.counters->covered, static_cast<unsigned long long>(covered));
}

}  // namespace

}  // namespace tetwarp::cuda_detail
