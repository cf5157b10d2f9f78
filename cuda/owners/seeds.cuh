// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/owners/gather_task.cuh"

/// What is known of a march before it begins: where its first voxels may come from, and whether it is at rest. For
/// gather.cu alone.
namespace tetwarp::cuda_detail {

namespace {

constexpr int kSeedTries = 40;  ///< from an undeformed guess

/// A guess for every march: where the first voxel of a column comes from, by repeated prediction. A thread a seed.
///
/// @param seeds  undeformed places in cells, one for each tile of kSeedTile x kSeedTile x kMarch voxels, i fastest:
///               written
__global__ void seed_kernel(GatherTask task, glm::vec3* seeds) {
  const std::int64_t n = thread_of_grid();
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

/// One warp the tile of voxels of a march: whether it lies within the undeformed lattice, and nothing that it and its
/// nudges reach there is displaced. Then the owner of a voxel that has but one is a cell at rest.
///
/// @param task  `resting` is written  @param marches  how many there are
__global__ void rest_kernel(GatherTask task, std::int64_t marches) {
  const std::int64_t number = warp_of_grid();
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
  const int lane = lane_of_warp();
  for (int n = lane; n < blocks.x * blocks.y * blocks.z; n += 32) {
    const glm::ivec3 at = from + glm::ivec3(n % blocks.x, n / blocks.x % blocks.y, n / (blocks.x * blocks.y));
    rests = rests && task.moving.moving[(at.z * task.moving.count.y + at.y) * task.moving.count.x + at.x] == 0;
  }
  const bool all = __all_sync(kAllLanes, rests) != 0;
  if (lane == 0) task.resting[number] = all;
}

}  // namespace

}  // namespace tetwarp::cuda_detail
