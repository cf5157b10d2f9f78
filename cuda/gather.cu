#include "cuda/gather.h"
#include "cuda/voxel_sink.cuh"
#include "deform/core/gather.h"
#include "deform/core/visit_cell.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kMarch = 32;      ///< voxels along k that a thread goes
constexpr int kWarps = 4;       ///< of a block, side by side along j
constexpr int kSeedTile = 8;    ///< voxels along i and j that share a seed
constexpr int kSeedTries = 40;  ///< from an undeformed guess
constexpr int kQueueTries = 6;  ///< in float, before the exact walk
constexpr int kWalk = 64;       ///< tetrahedra that the exact walk may pass
constexpr unsigned kQueueSize = 1u << 22;

/// What all kernels of a gather know.
struct Task {
  StepLattice lattice;
  Nudge nudge;
  SlabBox box;
  BitRows single;
  std::uint32_t* several;
  glm::ivec3 seeds;  ///< how many on each axis
  Gather::Entry* queue;
  Gather::Counters* counters;

  __device__ glm::ivec3 begin() const { return glm::ivec3(box.begin); }
  __device__ glm::ivec3 size() const { return glm::ivec3(box.size); }
  __device__ GatherPoint point(const glm::ivec3& voxel) const { return {voxel, nudge.signs(glm::i64vec3(voxel))}; }
  __device__ std::int64_t word(const glm::ivec3& in) const {
    return (std::int64_t{in.z} * size().y + in.y) * single.words_per_row + in.x / 32;
  }
};

__device__ bool is_finite(const glm::vec3& v) { return isfinite(v.x + v.y + v.z); }

/// A guess for every march: where the first voxel of a column comes from, by repeated prediction.
__global__ void seed_kernel(Task task, glm::vec3* seeds) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= std::int64_t{task.seeds.x} * task.seeds.y * task.seeds.z) return;
  const glm::ivec3 at(n % task.seeds.x, n / task.seeds.x % task.seeds.y, n / (task.seeds.x * task.seeds.y));
  const glm::ivec3 voxel =
      glm::min(at * glm::ivec3(kSeedTile, kSeedTile, kMarch) + glm::ivec3(kSeedTile / 2, kSeedTile / 2, 0),
               task.size() - 1) +
      task.begin();
  const GatherPoint point = task.point(voxel);
  const glm::vec3 undeformed = task.lattice.place(glm::vec3(voxel));
  glm::vec3 place = undeformed;
  bool found = false;
  for (int n_try = 0; n_try < kSeedTries && !found; ++n_try) {
    const Trial trial = try_tetrahedron(task.lattice, tetrahedron_at(task.lattice, place), point);
    found = trial.owns;
    place = is_finite(trial.place) ? trial.place : undeformed;
  }
  seeds[n] = place;
}

/// What a warp could not settle at once, to be tried again when a warp full has come together.
struct WarpQueue {
  Gather::Entry entries[64];
};

template <class Sink>
__device__ unsigned try_again(const Task& task, const Sink& sink, const Gather::Entry& entry) {
  const glm::ivec3 size = task.size();
  const glm::ivec3 in(entry.voxel % size.x, entry.voxel / size.x % size.y, entry.voxel / (size.x * size.y));
  const glm::ivec3 voxel = in + task.begin();
  const Trial trial =
      try_tetrahedron(task.lattice, tetrahedron_at(task.lattice, {entry.x, entry.y, entry.z}), task.point(voxel));
  if (trial.owns) return sink.write(voxel, trial.u);
  const unsigned place = atomicAdd(&task.counters->queued, 1u);
  if (place < kQueueSize) {
    task.queue[place] = {entry.voxel, trial.place.x, trial.place.y, trial.place.z};
  } else {
    atomicOr(&task.several[task.word(in)], 1u << (in.x & 31));
    atomicAdd(&task.counters->several, 1u);
  }
  return 0;
}

template <class Sink>
__global__ void __launch_bounds__(32 * kWarps) march_kernel(Task task, const glm::vec3* seeds, Sink sink) {
  __shared__ WarpQueue queues[kWarps];
  const int lane = static_cast<int>(threadIdx.x), warp = static_cast<int>(threadIdx.y);
  Gather::Entry* queue = queues[warp].entries;
  const glm::ivec3 size = task.size();
  glm::ivec3 in(blockIdx.x * 32 + lane, blockIdx.y * kWarps + warp, blockIdx.z * kMarch);
  if (in.y >= size.y) return;  // the whole warp
  const int last = min(in.z + kMarch, size.z);
  int first_down = static_cast<int>(task.nudge.first_down(2) - task.box.begin.z);
  const bool in_row = in.x < size.x;
  unsigned covered = 0;
  int waiting = 0;  // the same in all lanes
  const glm::ivec3 seed(min(in.x, size.x - 1) / kSeedTile, in.y / kSeedTile, blockIdx.z);
  const glm::ivec3 seeded =
      glm::min(seed * glm::ivec3(kSeedTile, kSeedTile, kMarch) + glm::ivec3(kSeedTile / 2, kSeedTile / 2, 0), size - 1);
  glm::vec3 place =
      seeds[(seed.z * task.seeds.y + seed.y) * task.seeds.x + seed.x] + glm::vec3(in - seeded) * task.lattice.voxel;
  std::int64_t word = task.word({blockIdx.x * 32, in.y, in.z});
  const std::int64_t words_per_slice = std::int64_t{size.y} * task.single.words_per_row;
  GatherPoint point = task.point(in + task.begin());
  if (in.z >= first_down) first_down = -1;  // turned already
  for (; in.z < last; ++in.z, word += words_per_slice, point.steps.z += float{kStepsPerVoxel}) {
    const glm::ivec3 voxel = in + task.begin();
    if (in.z == first_down) point.nudge.z = -point.nudge.z;
    const bool single = (task.single.words[word] >> lane & 1) != 0;
    const Trial trial = try_tetrahedron(task.lattice, tetrahedron_at(task.lattice, place), point);
    const bool again = single && !trial.owns;
    if (single && trial.owns) {
      covered += sink.write(voxel, trial.u);
    } else if (!single && in_row) {
      sink.nothing(voxel);
    }
    const unsigned votes = __ballot_sync(~0u, again);
    if (again) {
      const int at = waiting + __popc(votes & ((1u << lane) - 1));
      queue[at] = {(in.z * size.y + in.y) * size.x + in.x, trial.place.x, trial.place.y, trial.place.z};
    }
    waiting += __popc(votes);
    __syncwarp();
    if (waiting >= 32) {
      waiting -= 32;
      covered += try_again(task, sink, queue[waiting + lane]);
      __syncwarp();
    }
    place = trial.place + trial.per_slice;
  }
  if (lane < waiting) covered += try_again(task, sink, queue[lane]);
  covered = warp_sum(covered);
  if (lane == 0 && covered != 0) atomicAdd(&task.counters->covered, static_cast<unsigned long long>(covered));
}

/// The voxels that no prediction settled: a few more in float, then a walk with exact integers.
template <class Sink>
__global__ void queue_kernel(Task task, Sink sink) {
  const unsigned count = min(task.counters->queued, kQueueSize);
  const glm::ivec3 size = task.size();
  unsigned covered = 0;
  for (unsigned n = blockIdx.x * kThreads + threadIdx.x; n < count; n += gridDim.x * kThreads) {
    const Gather::Entry entry = task.queue[n];
    const glm::ivec3 in(entry.voxel % size.x, entry.voxel / size.x % size.y, entry.voxel / (size.x * size.y));
    const glm::ivec3 voxel = in + task.begin();
    const GatherPoint point = task.point(voxel);
    glm::vec3 place(entry.x, entry.y, entry.z);
    bool settled = false;
    for (int n_try = 0; n_try < kQueueTries && !settled; ++n_try) {
      if (!is_finite(place)) place = task.lattice.place(glm::vec3(voxel));
      const Trial trial = try_tetrahedron(task.lattice, tetrahedron_at(task.lattice, place), point);
      settled = trial.owns;
      if (settled) covered += sink.write(voxel, trial.u);
      place = trial.place;
    }
    if (settled) continue;
    if (!is_finite(place)) place = task.lattice.place(glm::vec3(voxel));
    const glm::i32vec3 steps = detail::to_steps(glm::i64vec3(voxel)), signs = task.nudge.signs(glm::i64vec3(voxel));
    LatticeTetrahedron owner;
    if (walk_to_owner(task.lattice, as_lattice(tetrahedron_at(task.lattice, place)), steps, signs, kWalk, owner)) {
      covered += sink.write(voxel, interpolate_u(vertices_of(task.lattice, owner), steps, signs));
    } else {
      atomicOr(&task.several[task.word(in)], 1u << (in.x & 31));
      atomicAdd(&task.counters->several, 1u);
    }
  }
  if (covered != 0) atomicAdd(&task.counters->covered, static_cast<unsigned long long>(covered));
}

/// How many voxels are to be claimed.
__global__ void count_kernel(const std::uint32_t* several, std::int64_t words, Gather::Counters* counters) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  const unsigned bits = n < words ? static_cast<unsigned>(__popc(several[n])) : 0;
  const unsigned sum = warp_sum(bits);
  if ((threadIdx.x & 31) == 0 && sum != 0) atomicAdd(&counters->several, sum);
}

template <class Sink>
__global__ void settle_kernel(DeviceField field, SlabBox slab, const std::uint32_t* several,
                              const unsigned long long* owner, Sink sink, Gather::Counters* counters) {
  const std::int64_t n = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (n >= slab.count()) return;
  const glm::i64vec3 in(n % slab.size.x, n / slab.size.x % slab.size.y, n / (slab.size.x * slab.size.y));
  const std::int64_t word = (in.z * slab.size.y + in.y) * ((slab.size.x + 31) / 32) + in.x / 32;
  if ((several[word] >> (in.x & 31) & 1) == 0) return;
  const glm::i64vec3 voxel = in + slab.begin;
  if (owner[n] == kNobody) return sink.nothing(glm::ivec3(voxel));
  const Tetrahedron t = tetrahedron_numbered(field, owner[n]);
  if (sink.write(glm::ivec3(voxel), interpolate_u(t, detail::to_steps(voxel), field.frame.nudge.signs(voxel))))
    atomicAdd(&counters->covered, 1ULL);
}

}  // namespace

template <class Sink>
std::uint64_t Gather::run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream) {
  const DeviceField& field = lattice.field();
  coverage_.find(field, lattice.inverted_cells(), lattice.statistics().inverted != 0, box, stream);
  const glm::ivec3 size(box.size), tile(kSeedTile, kSeedTile, kMarch);
  Task task{field.steps,
            field.frame.nudge,
            box,
            coverage_.single(),
            coverage_.several(),
            (size + tile - 1) / tile,
            queue_.reserve(kQueueSize),
            counters_.reserve(1)};
  counters_.fill(0, 1, stream);
  const std::int64_t seeds = std::int64_t{task.seeds.x} * task.seeds.y * task.seeds.z;
  glm::vec3* seeded = seeds_.reserve(static_cast<std::size_t>(seeds));
  const std::int64_t words = std::int64_t{size.y} * size.z * coverage_.words_per_row();
  count_kernel<<<blocks_for(words), kThreads, 0, stream>>>(coverage_.several(), words, counters_.data());
  seed_kernel<<<blocks_for(seeds), kThreads, 0, stream>>>(task, seeded);
  const dim3 blocks(static_cast<unsigned>((size.x + 31) / 32), static_cast<unsigned>((size.y + kWarps - 1) / kWarps),
                    static_cast<unsigned>((size.z + kMarch - 1) / kMarch));
  march_kernel<<<blocks, dim3(32, kWarps), 0, stream>>>(task, seeded, sink);
  queue_kernel<<<1024, kThreads, 0, stream>>>(task, sink);
  TETWARP_CUDA_TRY(cudaGetLastError());
  Counters counters;
  counters_.download(&counters, 1, stream);
  if (counters.several != 0) {
    settle_several(lattice, box, sink, stream);
    counters_.download(&counters, 1, stream);
  }
  return counters.covered;
}

template <class Sink>
void Gather::settle_several(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream) {
  constexpr std::int64_t kClaimedAtOnce = std::int64_t{1} << 22;
  const std::int64_t slice = box.size.x * box.size.y, slices = std::max<std::int64_t>(1, kClaimedAtOnce / slice);
  for (std::int64_t z = 0; z < box.size.z; z += slices) {
    const SlabBox slab{box.begin + glm::i64vec3(0, 0, z), {box.size.x, box.size.y, std::min(slices, box.size.z - z)}};
    const std::uint32_t* several = coverage_.several() + z * box.size.y * coverage_.words_per_row();
    claims_.claim(lattice.field(), slab, several, false, stream);
    settle_kernel<<<blocks_for(slab.count()), kThreads, 0, stream>>>(lattice.field(), slab, several, claims_.owner(),
                                                                     sink, counters_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
}

template std::uint64_t Gather::run(const LatticeOnDevice&, const SlabBox&, const OffsetSink&, cudaStream_t);
template std::uint64_t Gather::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::uint8_t>&,
                                   cudaStream_t);
template std::uint64_t Gather::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::int16_t>&,
                                   cudaStream_t);
template std::uint64_t Gather::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::uint16_t>&,
                                   cudaStream_t);

}  // namespace tetwarp::cuda_detail
