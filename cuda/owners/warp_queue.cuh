// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/gather_task.cuh"

/// Voxels that wait until a warp full of them has come together. For the march alone.
namespace tetwarp::cuda_detail {

namespace {

constexpr int kWarpTries = 3;  ///< of a voxel within its warp, after the first

/// What a warp could not settle at once. It is tried again when a warp full has come together, so that all lanes work.
///
/// In coarse fields cells are large, so float is often unsure: exact integers are asked before another tetrahedron is
/// tried.
template <class Sink>
struct WarpQueue {
  struct WaitingVoxel {
    int voxel;      ///< packed by `word_of`
    float x, y, z;  ///< where it may come from: undeformed place, cells
  };

  /// Which voxel of the march waits, and how often it was tried again:
  ///
  ///     31            12   11   10       5 4      0
  ///     +---------------+------+----------+--------+
  ///     |    Attempt    |   0  |  Slice   |  Lane  |
  ///     +---------------+------+----------+--------+
  using Lane = BitField<0, 5, int>;            ///< whose column it is in
  using Slice = BitField<Lane::kEnd, 6, int>;  ///< from the first of the march on
  using Attempt = BitField<Slice::kEnd + 1, 20, int>;
  static_assert(Slice::kMost + 1 == kMarch && Attempt::kEnd == 32);

  __device__ static int word_of(int lane, int slice) { return Lane::put(lane) | Slice::put(slice); }
  __device__ static glm::ivec3 voxel_of(int word) {
    return of_lane(Lane::get(word)) + glm::ivec3(0, 0, Slice::get(word));
  }

  WaitingVoxel* voxels;  ///< 64, in shared memory
  glm::ivec3 first;      ///< voxel of lane 0 at the beginning of the march
  int lane, waiting = 0;

  /// Called by the whole warp.
  /// @param votes  lanes that have one  @param word  from `word_of`  @param place  undeformed, cells
  __device__ void push(unsigned votes, int word, const glm::vec3& place) {
    if ((votes >> lane & 1) != 0) voxels[waiting + rank_among(votes, lane)] = {word, place.x, place.y, place.z};
    waiting += __popc(votes);
    __syncwarp();
  }

  /// Tries up to 32 of them once more. @return how many of this lane are covered
  __device__ unsigned drain(const GatherTask& task, const Sink& sink) {
    const int taken = min(waiting, 32);
    waiting -= taken;
    bool again = false;
    unsigned covered = 0;
    int word = 0;
    glm::vec3 place(0);
    if (lane < taken) {
      const WaitingVoxel queued = voxels[waiting + lane];
      const glm::ivec3 in = first + voxel_of(queued.voxel), at = in + task.begin();
      const FloatTetrahedron t = tetrahedron_at(task.lattice, {queued.x, queued.y, queued.z});
      const Trial trial = try_tetrahedron(task.lattice, t, task.point(at));
      if (trial.owns || (kIsCoarse<Sink> && trial.unsure && task.owns(t, at))) {
        covered = sink.write(sink.address(at), at, offset_for<Sink>(task, trial, at));
      } else if (Attempt::get(queued.voxel) < kWarpTries) {
        again = true;
        word = queued.voxel + Attempt::put(1);
        place = Attempt::get(queued.voxel) == 0 ? trial.place()
                                                : (trial.place() + glm::vec3(queued.x, queued.y, queued.z)) * 0.5f;
      } else {
        task.put_aside(in, trial.place());
      }
    }
    __syncwarp();
    push(__ballot_sync(kAllLanes, again), word, place);
    return covered;
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
