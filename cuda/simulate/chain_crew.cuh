// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cooperative_groups.h>

#include "cuda/runtime/launch.cuh"
#include "cuda/runtime/warp.cuh"
#include "deform/simulate/chain_plan.h"
#include "deform/simulate/simulation.h"

/// The kernels of ChainMail. For chainmail.cu alone.
namespace tetwarp::simulate {

namespace {

constexpr int kThreads = 512;
constexpr int kBlocksPerProcessor = 1;  ///< so that other kernels run beside it

/// What the blocks of a launch tell each other, and a launch the next one.
///
/// Of `changed` and `new_motion` there are three, used in turn: while all blocks write that of this round, slow ones
/// may still read that of the round before, and the first thread of all clears that of the next.
///
///     round        n            n + 1        n + 2
///     [n % 3]      written      read         cleared
struct Notes {
  Pacer pacer;
  std::int32_t steps;                ///< made so far
  bool reached;                      ///< whether the motion was small
  std::uint64_t motion;              ///< square of the largest of the last step
  unsigned changed[3];               ///< whether some block changed something
  unsigned long long new_motion[3];  ///< square of the largest motion
};

/// What all kernels know; all arrays have one entry for each node, unless said otherwise.
struct Job {
  ChainView chain;
  const std::int32_t* begins;  ///< first node of each block of nodes, and the end of the last
  int blocks;                  ///< of nodes
  Units *now, *before;         ///< displacement, and that of the step before
  Units* shown;                ///< displacement of the last frame that was shown
  Units *upper, *lower;        ///< limits that `tighten` narrows
  DisplacementRange* ranges;   ///< within which a node may be
  PlacedNode* placed;          ///< `placed_count` nodes that are put somewhere
  int placed_count;
  double part, motion_mm;  ///< of the way to the goals; and below which motion is small
  Notes* notes;
};

/// One launch: all its blocks run at the same time, and each always works on the same nodes. What a thread writes to
/// its nodes, others may read at once or later: `tighten` ends at the same numbers either way.
class Crew {
 public:
  __device__ explicit Crew(const Job& job) : job_(job) {}

  __device__ void wait() { cooperative_groups::this_grid().sync(); }

  /// Calls `work` for the nodes of this thread.
  template <class Work>
  __device__ void for_nodes(Work&& work) const {
    for (int block = blockIdx.x; block < job_.blocks; block += gridDim.x) for_nodes_of(block, work);
  }

  /// To where nothing changes; begun after `wait`. Each block goes on by itself for as long as it can.
  ///
  /// In the last round nobody changes anything, so that all have read what there is.
  __device__ void tighten_all() {
    for (bool more = true; more; ++round_) {
      bool any = false;
      for (int block = blockIdx.x; block < job_.blocks; block += gridDim.x) {
        for (bool changed = true; changed;) {
          changed = false;
          for_nodes_of(block, [&](std::int32_t n) { changed |= tighten(job_.chain, job_.upper, job_.lower, n); });
          changed = __syncthreads_or(changed);
          any |= changed;
        }
      }
      if (threadIdx.x == 0) {
        if (any) atomicExch(&job_.notes->changed[round_ % 3], 1u);
        if (blockIdx.x == 0) atomicExch(&job_.notes->changed[(round_ + 1) % 3], 0u);
      }
      wait();
      more = __ldcg(&job_.notes->changed[round_ % 3]) != 0;
    }
  }

  /// Tightens all from the placed nodes of a set. @param farthest  where nothing holds a node
  /// @param where  `where(one)` is the displacement of a placed node
  template <class Where>
  __device__ void spread(std::int32_t farthest, const PlacedSet& set, const Where& where) {
    for_nodes([&](std::int32_t n) {
      job_.upper[n] = {{farthest, farthest, farthest}};
      job_.lower[n] = {{-farthest, -farthest, -farthest}};
    });
    wait();
    for (std::size_t n = set.begin + blockIdx.x * kThreads + threadIdx.x; n < set.end;
         n += std::size_t{gridDim.x} * kThreads) {
      const PlacedNode& one = job_.placed[n];
      job_.upper[one.node] = job_.lower[one.node] = where(one);
    }
    wait();
    tighten_all();
  }

  /// Brings each node within what placed nodes leave to it, `range(n)`. @return as `finish`
  template <class Range>
  __device__ std::uint64_t clamp_all(const Range& range) {
    return finish([&](std::int32_t n) {
      job_.ranges[n] = range(n);
      return clamped(job_.now[n], job_.ranges[n]);
    });
  }

  /// Puts each node where `place` says. @return square of the largest motion of all
  template <class PlaceNodes>
  __device__ std::uint64_t finish(PlaceNodes&& place) {
    unsigned long long motion = 0;
    for_nodes([&](std::int32_t n) {
      const Units from = job_.now[n], to = place(n);
      job_.before[n] = from;
      job_.now[n] = to;
      motion = max(motion, static_cast<unsigned long long>(square_of_motion(from, to)));
    });
    motion = cuda_detail::warp_max(motion);
    if (cuda_detail::lane_of_warp() == 0 && motion != 0) atomicMax(&job_.notes->new_motion[finish_ % 3], motion);
    if (threadIdx.x == 0 && blockIdx.x == 0) atomicExch(&job_.notes->new_motion[(finish_ + 1) % 3], 0ull);
    wait();
    return __ldcg(&job_.notes->new_motion[finish_++ % 3]);
  }

 private:
  template <class Work>
  __device__ void for_nodes_of(int block, Work&& work) const {
    const std::int32_t end = job_.begins[block + 1];
    for (std::int32_t n = job_.begins[block] + static_cast<std::int32_t>(threadIdx.x); n < end; n += kThreads) work(n);
  }

  const Job& job_;
  unsigned round_ = 0, finish_ = 0;
};

__device__ bool is_first_thread() { return blockIdx.x == 0 && threadIdx.x == 0; }

/// The chain stage: limits from the placed nodes spread over all links, and every node is brought within its own. A
/// cooperative launch, so that all blocks run at the same time.
///
/// @param job    `upper`, `lower`, `ranges`, `now`, `before` are written; `notes` are 0 before
/// @param pacer  with which relaxation begins: it goes into the notes
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    follow_kernel(const __grid_constant__ Job job, Pacer pacer) {
  Crew crew(job);
  crew.spread(kFarthest, {0, static_cast<std::size_t>(job.placed_count)},
              [&](const PlacedNode& one) { return one.at(job.part); });
  const std::uint64_t motion =
      crew.clamp_all([&](std::int32_t n) { return range_between(job.upper[n], job.lower[n]); });
  if (!is_first_thread()) return;
  job.notes->pacer = pacer;
  job.notes->motion = motion;
}

/// The paths from a set of placed nodes. A cooperative launch.
///
/// @param job    `upper` and `lower` are those of the set in its SetPaths: written  @param set  of `placed`
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    path_kernel(const __grid_constant__ Job job, PlacedSet set) {
  Crew crew(job);
  crew.spread(kNoPath, set, [](const PlacedNode&) { return Units{{0, 0, 0}}; });
}

/// Steps of relaxation, until `steps` in all are made or the motion is small. A cooperative launch.
///
/// @param job    `now`, `before`, `upper`, `lower` are written; `notes` are read, and written by the first thread
/// @param pacer  with which relaxation begins where `paths` are given; otherwise that of the notes goes on
/// @param paths  with them the chain stage comes first, as `follow_kernel` makes it; none: it was made
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    relax_kernel(const __grid_constant__ Job job, std::int32_t steps, Pacer pacer,
                 const __grid_constant__ SetPaths paths) {
  Crew crew(job);
  std::int32_t made = job.notes->steps;
  bool reached = false;
  std::uint64_t motion = 0;
  if (paths.count > 0) {
    motion = crew.clamp_all([&](std::int32_t n) { return paths.range(n); });
  } else {
    pacer = job.notes->pacer;
    motion = job.notes->motion;
  }
  while (made < steps && !reached) {
    crew.for_nodes([&](std::int32_t n) {
      job.upper[n] = job.lower[n] = relaxed(job.chain, job.now, job.before, job.ranges[n], pacer.pace, n);
    });
    crew.wait();
    crew.tighten_all();
    motion = crew.finish([&](std::int32_t n) { return halfway(job.upper[n], job.lower[n]); });
    ++made;
    reached = sqrt(static_cast<double>(motion)) / kUnitsPerMm <= job.motion_mm;
    pacer.follow(motion);
  }
  if (!is_first_thread()) return;
  job.notes->pacer = pacer;
  job.notes->steps = made;
  job.notes->reached = reached;
  job.notes->motion = motion;
}

/// Brings what is in `upper` and `lower` within the limits, and writes `now`. A cooperative launch.
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) project_kernel(const __grid_constant__ Job job) {
  Crew crew(job);
  crew.tighten_all();
  crew.for_nodes([&](std::int32_t n) { job.now[n] = halfway(job.upper[n], job.lower[n]); });
}

/// Notes where placed nodes are now, from where they go to their goals. A thread a placed node.
__global__ void start_kernel(Job job) {
  const int n = static_cast<int>(blockIdx.x * kThreads + threadIdx.x);
  if (n < job.placed_count) job.placed[n].start = job.shown[job.placed[n].node];
}

/// Puts placed nodes where they belong, over what is shown of all. A thread a placed node.
__global__ void show_placed_kernel(Job job) {
  const int n = static_cast<int>(blockIdx.x * kThreads + threadIdx.x);
  if (n >= job.placed_count) return;
  const PlacedNode& one = job.placed[n];
  job.shown[one.node] = one.at(job.part);
}

/// Gives the displacement of all nodes. A thread a node.
///
/// @param direction     of the lattice  @param node_of  place of each node in `displacement`
/// @param square        see `shown_of`
/// @param displacement  LPS mm, written
__global__ void show_kernel(Job job, glm::dmat3 direction, const std::int32_t* node_of, float square,
                            glm::vec3* displacement) {
  const int n = static_cast<int>(blockIdx.x * kThreads + threadIdx.x);
  if (n >= job.chain.nodes) return;
  glm::vec3& shown = displacement[node_of[n]];
  shown = shown_of(shown, to_lps(direction, job.shown[n]), square);
}

}  // namespace

}  // namespace tetwarp::simulate
