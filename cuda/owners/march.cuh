// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/voxel_sink.cuh"
#include "cuda/owners/gather.cuh"
#include "deform/core/gather.h"

/// The march of a gather: seeds, what rests, and the kernel that goes along k. For gather.cu alone.
namespace tetwarp::cuda_detail {

namespace {

constexpr int kAlongI = 16;            ///< voxels of a warp along i
constexpr int kAlongJ = 32 / kAlongI;  ///< and along j
constexpr int kMarch = 64;             ///< voxels along k that a thread goes; a multiple of 32
constexpr int kWarps = 4;              ///< of a block
constexpr int kAcross = 2;             ///< of these side by side along i
constexpr int kBlocks = 6;             ///< a multiprocessor
constexpr int kCopied = 16;            ///< voxels of a lane that are on their way together
constexpr int kSeedTile = 8;           ///< voxels along i and j that share a seed
constexpr int kSeedTries = 40;         ///< from an undeformed guess
constexpr int kRounds = 10;            ///< at the first slice of a march, while guesses fail
constexpr int kFewFailed = 3;          ///< lanes
constexpr int kWarpTries = 3;          ///< of a voxel within its warp, after the first
constexpr unsigned kQueueSize = 1u << 20;

/// Where a lane's voxels are in those of its warp.
__device__ glm::ivec3 of_lane(int lane) { return {lane % kAlongI, lane / kAlongI, 0}; }

/// How many marches a box takes on each axis.
__host__ __device__ inline glm::ivec3 marches_of(const glm::ivec3& size) {
  const glm::ivec3 march(kAlongI, kAlongJ, kMarch);
  return (size + march - 1) / march;
}

/// What all kernels of a gather know.
struct Task {
  StepLattice lattice;
  NudgeTurns nudge;
  SlabBox box;
  BitRows single;
  std::uint32_t* several;
  MovingBlocks moving;
  std::uint8_t* resting;  ///< of each march, whether all that it needs is at rest; i fastest
  glm::ivec3 seeds;       ///< how many on each axis
  Gather::Entry* queue;
  Gather::Counters* counters;

  __device__ glm::ivec3 begin() const { return glm::ivec3(box.begin); }
  __device__ glm::ivec3 size() const { return glm::ivec3(box.size); }
  __device__ GatherPoint point(const glm::ivec3& voxel) const { return {lattice, voxel, nudge.signs(voxel)}; }
  /// Whether a tetrahedron owns a voxel, exactly; rarely called.
  __device__ __noinline__ bool owns(FloatTetrahedron t, glm::ivec3 voxel) const {
    int sides[4];
    return owns_exactly(vertices_of(lattice, as_lattice(t)), voxel * kStepsPerVoxel, nudge.signs(voxel), sides);
  }
  /// How many marches there are on each axis.
  __device__ glm::ivec3 marches() const { return marches_of(size()); }
  __device__ int march_number(const glm::ivec3& at) const {
    const glm::ivec3 count = marches();
    return (at.z * count.y + at.y) * count.x + at.x;
  }
  /// The voxel of the box that a seed is for.
  __device__ glm::ivec3 seeded(const glm::ivec3& seed) const {
    const glm::ivec3 middle(kSeedTile / 2, kSeedTile / 2, 0);
    return glm::min(seed * glm::ivec3(kSeedTile, kSeedTile, kMarch) + middle, size() - 1);
  }
  /// Leaves a voxel to the walk or, where its queue is full, to the claims.
  __device__ void put_aside(const glm::ivec3& in, const glm::vec3& place) const {
    const unsigned n = atomicAdd(&counters->queued, 1u);
    if (n < kQueueSize) {
      queue[n] = {(in.z * size().y + in.y) * size().x + in.x, place.x, place.y, place.z};
    } else {
      leave_to_claims(in);
    }
  }
  __device__ void leave_to_claims(const glm::ivec3& in) const {
    atomicOr(&several[word(in)], 1u << (in.x & 31));
    atomicAdd(&counters->left, 1u);
  }
  __device__ std::int64_t word(const glm::ivec3& in) const {
    return (std::int64_t{in.z} * size().y + in.y) * single.words_per_row + in.x / 32;
  }
};

/// Keeps the compiler from computing a value again at every use.
__device__ void keep(float& value) { asm volatile("" : "+f"(value)); }

__device__ bool is_finite(const glm::vec3& v) { return isfinite(v.x + v.y + v.z); }

/// A guess for every march: where the first voxel of a column comes from, by repeated prediction.
__global__ void seed_kernel(Task task, glm::vec3* seeds) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= std::int64_t{task.seeds.x} * task.seeds.y * task.seeds.z) return;
  const glm::ivec3 at(n % task.seeds.x, n / task.seeds.x % task.seeds.y, n / (task.seeds.x * task.seeds.y));
  const glm::ivec3 voxel = task.seeded(at) + task.begin();
  const GatherPoint point = task.point(voxel);
  const glm::vec3 undeformed = task.lattice.place(glm::vec3(voxel));
  glm::vec3 place = undeformed;
  bool found = false;
  for (int n_try = 0; n_try < kSeedTries && !found; ++n_try) {
    const Trial trial = try_tetrahedron(task.lattice, tetrahedron_at(task.lattice, place), point);
    found = trial.owns;
    place = is_finite(trial.place()) ? (n_try < 8 ? trial.place() : (place + trial.place()) * 0.5f) : undeformed;
  }
  seeds[n] = place;
}

/// What a warp could not settle at once. It is tried again when a warp full has come together, so that all lanes work.
///
/// @tparam kCoarse  cells are large, so float is often unsure: ask exact integers before another tetrahedron is tried
template <class Sink, bool kCoarse>
struct WarpQueue {
  struct Entry {
    int voxel;  ///< lane, voxels along k from the first of the march << 5, and failed attempts << kAttempt
    float x, y, z;
  };

  static constexpr int kAttempt = 12;

  Entry* entries;    ///< 64, in shared memory
  glm::ivec3 first;  ///< voxel of lane 0 at the beginning of the march
  int lane, waiting = 0;

  /// Called by the whole warp. @param votes  lanes that have one
  __device__ void push(unsigned votes, int voxel, const glm::vec3& place) {
    if ((votes >> lane & 1) != 0)
      entries[waiting + __popc(votes & ((1u << lane) - 1))] = {voxel, place.x, place.y, place.z};
    waiting += __popc(votes);
    __syncwarp();
  }

  /// Tries up to 32 of them once more. @return how many of this lane are covered
  __device__ unsigned drain(const Task& task, const Sink& sink) {
    const int taken = min(waiting, 32);
    waiting -= taken;
    bool again = false;
    unsigned covered = 0;
    int voxel = 0;
    glm::vec3 place(0);
    if (lane < taken) {
      const Entry entry = entries[waiting + lane];
      const glm::ivec3 in = first + of_lane(entry.voxel & 31) + glm::ivec3(0, 0, entry.voxel >> 5 & (kMarch - 1));
      const glm::ivec3 at = in + task.begin();
      const FloatTetrahedron t = tetrahedron_at(task.lattice, {entry.x, entry.y, entry.z});
      const Trial trial = try_tetrahedron(task.lattice, t, task.point(at));
      if (trial.owns || (kCoarse && trial.unsure && task.owns(t, at))) {
        covered = sink.write(sink.place(at), at, trial.u());
      } else if (entry.voxel >> kAttempt < kWarpTries) {
        again = true;
        voxel = entry.voxel + (1 << kAttempt);
        place = entry.voxel >> kAttempt == 0 ? trial.place()
                                             : (trial.place() + glm::vec3(entry.x, entry.y, entry.z)) * 0.5f;
      } else {
        task.put_aside(in, trial.place());
      }
    }
    __syncwarp();
    push(__ballot_sync(~0u, again), voxel, place);
    return covered;
  }
};

/// One warp the tile of voxels of a march: whether it lies within the undeformed lattice, and nothing that it and its
/// nudges reach there is displaced. Then the owner of a voxel that has but one is a cell at rest.
__global__ void rest_kernel(Task task, std::int64_t marches) {
  const std::int64_t number = (std::int64_t{blockIdx.x} * kThreads + threadIdx.x) / 32;
  if (number >= marches) return;
  const StepLattice& lattice = task.lattice;
  const glm::ivec3 size = task.size(), count = task.marches();
  const glm::ivec3 march(kAlongI, kAlongJ, kMarch);
  const glm::ivec3 first = glm::ivec3(number % count.x, number / count.x % count.y, number / count.x / count.y) * march;
  const glm::ivec3 low = task.begin() + first, high = task.begin() + glm::min(first + march, size) - 1;
  bool rests = true;
  for (int axis = 0; axis < 3; ++axis) {  // exact, in 2^-12 voxel
    const float from = static_cast<float>(low[axis]) * kStepsPerVoxel - lattice.first[axis],
                to = static_cast<float>(high[axis]) * kStepsPerVoxel - lattice.first[axis];
    rests = rests && from >= 0 && to <= static_cast<float>(lattice.cells[axis]) * lattice.cell[axis];
  }
  constexpr float kBeyond = 1.0f / 64;  // voxels
  const auto block = [&](const glm::vec3& place, int beyond) {
    return glm::ivec3(detail::clamp_to(detail::floor_to_int(place.x) + beyond, lattice.cells.x),
                      detail::clamp_to(detail::floor_to_int(place.y) + beyond, lattice.cells.y),
                      detail::clamp_to(detail::floor_to_int(place.z) + beyond, lattice.cells.z)) /
           MovingBlocks::kSide;
  };
  const glm::ivec3 from = block(lattice.place(glm::vec3(low) - kBeyond), 0),
                   blocks = block(lattice.place(glm::vec3(high) + kBeyond), 1) - from + 1;
  const int lane = static_cast<int>(threadIdx.x & 31);
  for (int n = lane; n < blocks.x * blocks.y * blocks.z; n += 32) {
    const glm::ivec3 at = from + glm::ivec3(n % blocks.x, n / blocks.x % blocks.y, n / (blocks.x * blocks.y));
    rests = rests && task.moving.moving[(at.z * task.moving.count.y + at.y) * task.moving.count.x + at.x] == 0;
  }
  const bool all = __all_sync(~0u, rests) != 0;
  if (lane == 0) task.resting[number] = all;
}

/// Asks for a vertex two slices on, near which a march will be.
__device__ inline void prefetch(const StepLattice& lattice, const FloatTetrahedron& t) {
  const auto slice = static_cast<unsigned>(lattice.slice), last = slice * static_cast<unsigned>(lattice.cells.z);
  const std::uint64_t* vertex = lattice.packed + min(static_cast<unsigned>(t.offset) + 2 * slice, last);
  asm volatile("prefetch.global.L2 [%0];" ::"l"(vertex));
}

/// Bit n of lane m from bit m of lane n.
__device__ inline std::uint32_t transposed(std::uint32_t bits, int lane) {
  std::uint32_t mask = 0x0000FFFF;
#pragma unroll
  for (int step = 16; step > 0; step /= 2, mask ^= mask << step) {
    const std::uint32_t other = __shfl_xor_sync(~0u, bits, step);
    bits = (lane & step) != 0 ? (bits & ~mask) | (other >> step & mask) : (bits & mask) | (other << step & ~mask);
  }
  return bits;
}

/// One warp: kAlongI voxels along i, kAlongJ along j, up to kMarch along k.
template <class Sink, bool kCoarse>
struct March {
  static constexpr Effort kEffort = kCoarse ? Effort::close : Effort::quick;

  const Task& task;
  const Sink& sink;
  glm::ivec3 first;  ///< voxel of lane 0 in the box
  int lane, slices;
  bool in_box;  ///< whether this lane has voxels

  __device__ glm::ivec3 voxel(int n) const { return first + task.begin() + of_lane(lane) + glm::ivec3(0, 0, n); }

  /// Which voxels of this lane have one owner: bit n for slice `from` + n.
  __device__ std::uint32_t read_singles(int from) const {
    const int n = from + lane;
    std::uint32_t bits = 0;
    if (n < slices) {
#pragma unroll
      for (int j = 0; j < kAlongJ; ++j) {
        if (first.y + j >= task.size().y) break;
        const std::uint32_t word = task.single.words[task.word({first.x, first.y + j, first.z + n})];
        bits |= (word >> first.x % 32 & (~0u >> (32 - kAlongI))) << j * kAlongI;
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
  __device__ int predict(glm::vec3 place, WarpQueue<Sink, kCoarse> queue) const {
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
    const std::uint32_t all = ~0u >> (32 - (end - n));
    for (std::uint32_t left = ~singles & all; left != 0; left &= left - 1)
      sink.nothing(sink.place(voxel(n + __ffs(static_cast<int>(left)) - 1)));
  }

  /// From slice n to slice `end`, or until the queue holds a warp full: then n is where to go on.
  /// @param singles  which voxels of this lane have one owner, from the lowest bit on
  /// @return how many of this lane are covered
  __device__ int run(int& n, int end, std::uint32_t singles, int& rounds, glm::vec3& place,
                     WarpQueue<Sink, kCoarse>& queue) const {
    glm::ivec3 at = voxel(n);
    const int out_slice = sink.per_slice();
    int out = sink.place(at) - out_slice, failures = 0;
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
      if (!kCoarse) prefetch(task.lattice, t);
      sink.finish(out, pending);
      out += out_slice;
      const Trial trial = try_tetrahedron<kEffort>(t, local, point);
      const bool single = (singles & 1) != 0;
      sink.start(out, at, trial.moved, single & trial.owns, pending);
      const bool again = single & !pending.any;
      const unsigned failed = __ballot_sync(~0u, again);
      if (failed != 0) {
        const bool lost = single & !trial.owns;
        if (n == 0 && rounds < kRounds && __popc(__ballot_sync(~0u, lost)) > kFewFailed) {  // no good seed: once more
          const glm::vec3 better = rounds++ < 3 ? trial.place() : (place + trial.place()) * 0.5f;
          if (lost) place = better;
          pending.any = false;
          out -= out_slice;
          continue;
        }
        queue.push(failed, lane | n << 5, trial.place());
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
    return __popc(wanted & ~0u >> (32 - (n - begin))) - failures;
  }
};

template <class Sink, bool kCoarse>
__global__ void __launch_bounds__(32 * kWarps, Sink::kIsWide ? kBlocks - 1 : kBlocks)
    march_kernel(const __grid_constant__ Task task, const glm::vec3* seeds, const __grid_constant__ Sink sink) {
  __shared__ typename WarpQueue<Sink, kCoarse>::Entry entries[kWarps][64];
  const int lane = static_cast<int>(threadIdx.x), warp = static_cast<int>(threadIdx.y);
  const glm::ivec3 size = task.size(),
                   march_at(blockIdx.x * kAcross + warp % kAcross, blockIdx.y * (kWarps / kAcross) + warp / kAcross,
                            blockIdx.z),
                   first = march_at * glm::ivec3(kAlongI, kAlongJ, kMarch);
  if (first.x >= size.x || first.y >= size.y) return;  // the whole warp
  const glm::ivec3 begin = first + of_lane(lane), inside = glm::min(begin, size - 1);
  const March<Sink, kCoarse> march{task, sink, first, lane, min(kMarch, size.z - first.z), begin == inside};
  int found = 0;
  if (task.resting[task.march_number(march_at)] != 0) {
    found = march.copy();
  } else {
    const glm::ivec3 seed(inside.x / kSeedTile, inside.y / kSeedTile, blockIdx.z);
    const glm::vec3 place = seeds[(seed.z * task.seeds.y + seed.y) * task.seeds.x + seed.x] +
                            glm::vec3(begin - task.seeded(seed)) * task.lattice.voxel;
    found = march.predict(place, {entries[warp], first, lane});
  }
  const unsigned covered = warp_sum(static_cast<unsigned>(found));
  if (lane == 0 && covered != 0) atomicAdd(&task.counters->covered, static_cast<unsigned long long>(covered));
}

}  // namespace

}  // namespace tetwarp::cuda_detail
