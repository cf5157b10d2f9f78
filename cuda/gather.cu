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
constexpr int kWarpTries = 3;   ///< of a voxel within its warp, after the first
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
  int first_down;    ///< first slice of the box that is nudged down
  Gather::Entry* queue;
  Gather::Counters* counters;

  __device__ glm::ivec3 begin() const { return glm::ivec3(box.begin); }
  __device__ glm::ivec3 size() const { return glm::ivec3(box.size); }
  __device__ GatherPoint point(const glm::ivec3& voxel) const {
    return {lattice, voxel, nudge.signs(glm::i64vec3(voxel))};
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
    atomicAdd(&counters->several, 1u);
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

/// What a warp could not settle at once. It is tried again when a warp full has come together, so that all lanes work.
template <class Sink>
struct WarpQueue {
  struct Entry {
    int voxel;  ///< lane, voxels along k from the first of the march << 5, and failed attempts << 10
    float x, y, z;
  };

  Entry* entries;    ///< 64, in shared memory
  glm::ivec3 first;  ///< voxel of lane 0 at the beginning of the march
  int lane, waiting = 0;

  /// Called by the whole warp.
  __device__ void push(bool wanted, int voxel, const glm::vec3& place) {
    const unsigned votes = __ballot_sync(~0u, wanted);
    if (wanted) entries[waiting + __popc(votes & ((1u << lane) - 1))] = {voxel, place.x, place.y, place.z};
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
      const glm::ivec3 in = first + glm::ivec3(entry.voxel & 31, 0, entry.voxel >> 5 & 31);
      const Trial trial = try_tetrahedron(task.lattice, tetrahedron_at(task.lattice, {entry.x, entry.y, entry.z}),
                                          task.point(in + task.begin()));
      if (trial.owns) {
        covered = sink.write(in + task.begin(), trial.u);
      } else if (entry.voxel >> 10 < kWarpTries) {
        again = true;
        voxel = entry.voxel + (1 << 10);
        place = trial.place;
      } else {
        task.put_aside(in, trial.place);
      }
    }
    __syncwarp();
    push(again, voxel, place);
    return covered;
  }
};

template <class Sink>
__global__ void __launch_bounds__(32 * kWarps, 8) march_kernel(Task task, const glm::vec3* seeds, Sink sink) {
  __shared__ typename WarpQueue<Sink>::Entry entries[kWarps][64];
  const int lane = static_cast<int>(threadIdx.x), warp = static_cast<int>(threadIdx.y);
  const glm::ivec3 size = task.size();
  glm::ivec3 in(blockIdx.x * 32 + lane, blockIdx.y * kWarps + warp, blockIdx.z * kMarch);
  if (in.y >= size.y) return;  // the whole warp
  const int last = min(in.z + kMarch, size.z);
  int first_down = task.first_down;
  const bool in_row = in.x < size.x;
  unsigned covered = 0;
  WarpQueue<Sink> queue{entries[warp], {in.x - lane, in.y, in.z}, lane};
  const glm::ivec3 seed(min(in.x, size.x - 1) / kSeedTile, in.y / kSeedTile, blockIdx.z);
  const glm::ivec3 seeded =
      glm::min(seed * glm::ivec3(kSeedTile, kSeedTile, kMarch) + glm::ivec3(kSeedTile / 2, kSeedTile / 2, 0), size - 1);
  glm::vec3 place =
      seeds[(seed.z * task.seeds.y + seed.y) * task.seeds.x + seed.x] + glm::vec3(in - seeded) * task.lattice.voxel;
  std::int64_t word = task.word({blockIdx.x * 32, in.y, in.z});
  const std::int64_t words_per_slice = std::int64_t{size.y} * task.single.words_per_row;
  GatherPoint point = task.point(in + task.begin());
  if (in.z >= first_down) first_down = -1;  // turned already
  keep(point.nudge.x);
  keep(point.nudge.y);
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
    if (__any_sync(~0u, again)) {
      queue.push(again, lane | (in.z - queue.first.z) << 5, trial.place);
      while (queue.waiting >= 32) covered += queue.drain(task, sink);
    }
    place = trial.place + trial.per_slice;
  }
  while (queue.waiting > 0) covered += queue.drain(task, sink);
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
      task.leave_to_claims(in);
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
  const glm::i64vec3 in = unravel(n, slab.size);
  const std::int64_t word = (in.z * slab.size.y + in.y) * ((slab.size.x + 31) / 32) + in.x / 32;
  if (several && (several[word] >> (in.x & 31) & 1) == 0) return;
  const glm::i64vec3 voxel = in + slab.begin;
  if (owner[n] == kNobody) return sink.nothing(glm::ivec3(voxel));
  const Tetrahedron t = tetrahedron_numbered(field, owner[n]);
  if (sink.write(glm::ivec3(voxel), interpolate_u(t, detail::to_steps(voxel), field.frame.nudge.signs(voxel))))
    atomicAdd(&counters->covered, 1ULL);
}

}  // namespace

template <class Sink>
Gather::Counters Gather::run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink,
                             cudaStream_t stream) {
  const DeviceField& field = lattice.field();
  counters_.fill(0, 1, stream);
  if (is_mostly_folded(lattice)) {
    claim_box(lattice, box, nullptr, sink, stream);
    Counters all = counters(stream);
    all.several = static_cast<unsigned>(box.count());
    return all;
  }
  coverage_.find(field, lattice.inverted_cells(), lattice.statistics().inverted != 0, box, stream);
  const glm::ivec3 size(box.size), tile(kSeedTile, kSeedTile, kMarch);
  Task task{field.steps,
            field.frame.nudge,
            box,
            coverage_.single(),
            coverage_.several(),
            (size + tile - 1) / tile,
            static_cast<int>(field.frame.nudge.first_down(2) - box.begin.z),
            queue_.reserve(kQueueSize),
            counters_.data()};
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
  const Counters found = counters(stream);
  if (found.several == 0) return found;
  claim_box(lattice, box, coverage_.several(), sink, stream);
  return counters(stream);
}

bool Gather::is_mostly_folded(const LatticeOnDevice& lattice) {
  constexpr std::int64_t kFew = 256;  // one inverted tetrahedron in so many
  const std::int64_t tetrahedra = kTetrahedraPerCell * lattice.field().cell_count();
  return static_cast<std::int64_t>(lattice.statistics().inverted) > tetrahedra / kFew;
}

Gather::Counters Gather::counters(cudaStream_t stream) const {
  Counters counters;
  counters_.download(&counters, 1, stream);
  return counters;
}

template <class Sink>
void Gather::claim_box(const LatticeOnDevice& lattice, const SlabBox& box, const std::uint32_t* several,
                       const Sink& sink, cudaStream_t stream) {
  constexpr std::int64_t kClaimedAtOnce = std::int64_t{1} << 23;
  const std::int64_t slice = box.size.x * box.size.y, slices = std::max<std::int64_t>(1, kClaimedAtOnce / slice);
  const std::int64_t words_per_slice = (box.size.x + 31) / 32 * box.size.y;
  for (std::int64_t z = 0; z < box.size.z; z += slices) {
    const SlabBox slab{box.begin + glm::i64vec3(0, 0, z), {box.size.x, box.size.y, std::min(slices, box.size.z - z)}};
    const std::uint32_t* only = several ? several + z * words_per_slice : nullptr;
    claims_.claim(lattice.field(), slab, only, false, stream);
    settle_kernel<<<blocks_for(slab.count()), kThreads, 0, stream>>>(lattice.field(), slab, only, claims_.owner(), sink,
                                                                     counters_.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
}

template Gather::Counters Gather::run(const LatticeOnDevice&, const SlabBox&, const OffsetSink&, cudaStream_t);
template Gather::Counters Gather::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::uint8_t>&,
                                      cudaStream_t);
template Gather::Counters Gather::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::int16_t>&,
                                      cudaStream_t);
template Gather::Counters Gather::run(const LatticeOnDevice&, const SlabBox&, const VoxelSink<std::uint16_t>&,
                                      cudaStream_t);

}  // namespace tetwarp::cuda_detail
