// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/gather.cuh"

#include <algorithm>

#include "cuda/owners/march.cuh"
#include "cuda/owners/seeds.cuh"
#include "cuda/runtime/fetch.h"
#include "deform/core/visit_cell.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kQueueTries = 6;                 ///< in float, before the exact walk
constexpr int kWalk = 24;                      ///< tetrahedra that the exact walk may pass
constexpr unsigned kClaimedAtOnce = 1u << 22;  ///< voxels, or those of a slice

/// The voxels that no prediction settled: a few more tries in float, then a walk with exact integers. Threads take
/// voxel after voxel of the queue.
///
/// @param task  what the walk does not reach either is added to `several`
/// @param walk  tetrahedra that it may pass; 0: none  @param sink  gets the voxels that are found
template <class Sink>
__global__ void queue_kernel(GatherTask task, int walk, Sink sink) {
  const unsigned count = min(task.counters->queued, kQueueSize);
  const glm::ivec3 size = task.size();
  unsigned covered = 0;
  for (unsigned n = blockIdx.x * kThreads + threadIdx.x; n < count; n += gridDim.x * kThreads) {
    const Gather::QueuedVoxel queued = task.queue[n];
    const glm::ivec3 in(queued.voxel % size.x, queued.voxel / size.x % size.y, queued.voxel / (size.x * size.y));
    const glm::ivec3 voxel = in + task.begin();
    const GatherPoint point = task.point(voxel);
    glm::vec3 place(queued.x, queued.y, queued.z);
    bool settled = false;
    for (int n_try = 0; n_try < kQueueTries && !settled; ++n_try) {
      if (!is_finite(place)) place = task.lattice.place(glm::vec3(voxel));
      const Trial trial = try_tetrahedron(task.lattice, tetrahedron_at(task.lattice, place), point);
      settled = trial.owns;
      if (settled) covered += sink.write(sink.address(voxel), voxel, offset_for<Sink>(task, trial, voxel));
      place =
          n_try == 0 ? trial.place() : (place + trial.place()) * 0.5f;  // full steps may go round in circles in folds
    }
    if (settled) continue;
    if (!is_finite(place)) place = task.lattice.place(glm::vec3(voxel));
    const glm::i32vec3 steps = detail::to_steps(glm::i64vec3(voxel)), signs = task.nudge.signs(voxel);
    LatticeTetrahedron owner;
    if (walk_to_owner(task.lattice, as_lattice(tetrahedron_at(task.lattice, place)), steps, signs, walk, owner)) {
      covered += sink.write(sink.address(voxel), voxel, offset_for<Sink>(task.lattice, owner, voxel, signs));
    } else {
      task.leave_to_claims(in);
    }
  }
  if (covered != 0) atomicAdd(&task.counters->covered, static_cast<unsigned long long>(covered));
}

/// Numbers the voxels that are to be claimed, and lists them: one thread a word. A scan over each warp, and one atomic
/// addition for all of it, give each word its numbers; which numbers a warp gets depends on the order of warps, but
/// nothing else does.
///
/// @param several   bits of the voxels, as `BitRows`  @param words  how many words
/// @param rank      of each word with a bit, number of its lowest one: written
/// @param numbered  their count: 0 before  @param voxels  of each number, its `BitNumber`: written
__global__ void number_kernel(const std::uint32_t* several, std::int64_t words, unsigned* rank, unsigned* numbered,
                              unsigned* voxels) {
  const std::int64_t n = thread_of_grid();
  const std::uint32_t bits = n < words ? several[n] : 0;
  const auto mine = static_cast<unsigned>(__popc(bits));
  const auto before = static_cast<unsigned>(warp_scan(__popc(bits)));  // of the warp, this one too
  unsigned first = 0;
  if (lane_of_warp() == 31 && before != 0) first = atomicAdd(numbered, before);
  first = __shfl_sync(kAllLanes, first, 31) + before - mine;
  if (bits == 0) return;
  rank[n] = first;
  for (std::uint32_t left = bits; left != 0; left &= left - 1)
    voxels[first++] = BitNumber::of(static_cast<unsigned>(n), first_bit(left));
}

/// From the owners of claimed voxels to their values; a thread a voxel.
///
/// @param begin   first voxel of the box to which the words of `voxels` belong
/// @param voxels  of each number, its `BitNumber`  @param count  how many
/// @param owner   of each number, the lowest number of an owner, or kNobody: from `Claims`
/// @param sink    gets all of them
template <class Sink>
__global__ void write_claimed_kernel(GatherTask task, glm::ivec3 begin, const unsigned* voxels, unsigned count,
                                     const unsigned long long* owner, Sink sink) {
  const unsigned n = blockIdx.x * kThreads + threadIdx.x;
  if (n >= count) return;
  const int words = task.single.words_per_row, rows = task.size().y;
  const unsigned word = BitNumber::Word::get(voxels[n]), bit = BitNumber::Bit::get(voxels[n]);
  const glm::ivec3 voxel = begin + glm::ivec3(word % words * 32 + bit, word / words % rows, word / words / rows);
  const int address = sink.address(voxel);
  if constexpr (std::is_same_v<Sink, OwnerSink>) {
    sink.owner[address] = owner[n] == kNobody ? kNoTetrahedron : static_cast<unsigned>(owner[n]);
    warp_count(&task.counters->covered, owner[n] != kNobody);
    return;
  } else {
    if (owner[n] == kNobody) return sink.nothing(address);
    const glm::ivec3& cells = task.lattice.cells;
    const unsigned long long cell = TetrahedronNumber::cell(owner[n]), row = cell / cells.x;
    const LatticeTetrahedron t = LatticeTetrahedron::of_cell(
        {static_cast<int>(cell % cells.x), static_cast<int>(row % cells.y), static_cast<int>(row / cells.y)},
        TetrahedronNumber::in_cell(owner[n]));
    warp_count(&task.counters->covered,
               sink.write(address, voxel, offset_for<Sink>(task.lattice, t, voxel, task.nudge.signs(voxel))));
  }
}

}  // namespace

template <class Sink>
Gather::Counters Gather::run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream,
                             const TileReuse& reuse) {
  const DeviceField& field = lattice.field();
  if constexpr (kIsCoarse<Sink>) {
    if (IntervalRaster::suits(field.steps, box, is_mostly_folded(lattice)))
      return run_intervals(lattice, box, sink, stream, reuse);
  }
  intervals_.forget_tiles();
  coverage_.begin(box, stream);
  const glm::ivec3 size(box.size), tile(kSeedTile, kSeedTile, kMarch);
  const glm::ivec3 marches = marches_of(size);
  GatherTask task{field.steps,
                  NudgeTurns(field.frame.nudge),
                  box,
                  {},
                  nullptr,
                  lattice.moving_blocks(),
                  resting_.reserve(std::size_t(marches.x) * std::size_t(marches.y) * std::size_t(marches.z)),
                  (size + tile - 1) / tile,
                  queue_.reserve(kQueueSize),
                  coverage_.counters()};
  const std::int64_t seeds = std::int64_t{task.seeds.x} * task.seeds.y * task.seeds.z;
  glm::vec3* seeded = seeds_.reserve(static_cast<std::size_t>(seeds));
  if (!beside_) beside_.emplace();
  beside_->begun.record(stream);
  coverage_.find(lattice, box, stream);
  beside_->begun.hold_back(beside_->stream.get());  // seeds and what rests do not wait for the coverage
  seed_kernel<<<blocks_for(seeds), kThreads, 0, beside_->stream.get()>>>(task, seeded);
  const std::int64_t march_count = std::int64_t{marches.x} * marches.y * marches.z;
  rest_kernel<<<blocks_for(march_count * 32), kThreads, 0, beside_->stream.get()>>>(task, march_count);
  beside_->seeded.record(beside_->stream.get());
  beside_->seeded.hold_back(stream);
  task.single = coverage_.single();
  task.several = coverage_.several();
  constexpr int kBlockI = kAcross * kAlongI, kBlockJ = kWarps / kAcross * kAlongJ;  // voxels of a block
  const dim3 blocks(static_cast<unsigned>((size.x + kBlockI - 1) / kBlockI),
                    static_cast<unsigned>((size.y + kBlockJ - 1) / kBlockJ), static_cast<unsigned>(marches.z));
  auto march = march_kernel<Sink, false>;
  if constexpr (kIsCoarse<Sink>) {
    task.maps = maps_of(field.steps, box, stream);
    if (task.maps) march = march_kernel<Sink, true>;
  }
  march<<<blocks, dim3(32, kWarps), 0, stream>>>(task, seeded, sink);
  queue_kernel<<<1024, kThreads, 0, stream>>>(task, is_mostly_folded(lattice) ? 0 : kWalk, sink);
  TETWARP_CUDA_TRY(cudaGetLastError());
  Counters found = counters(stream);
  if (found.left != 0) {
    coverage_.count_several(box, stream);
    found = counters(stream);
  }
  if (found.claimed == 0) return found;
  claim_several(task, field, sink, stream);
  return counters(stream);
}

bool Gather::can_find_owners(const LatticeOnDevice& lattice, const SlabBox& box) {
  return IntervalRaster::suits(lattice.field().steps, box, is_mostly_folded(lattice));
}

/// Tiles that too many tetrahedra reach are claimed.
template <class Sink>
Gather::Counters Gather::run_intervals(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink,
                                       cudaStream_t stream, const TileReuse& reuse) {
  const TileCounters settled = intervals_.run(lattice, box, sink, stream, reuse);
  if (settled.left == 0) return {settled.covered, 0, 0, 0};
  coverage_.forget(box, stream);
  intervals_.mark_left(lattice, box, coverage_.several(), stream);
  coverage_.count_several(box, stream);
  GatherTask task{lattice.field().steps, NudgeTurns(lattice.field().frame.nudge), box};
  task.single = coverage_.single();
  task.counters = coverage_.counters();
  claim_several(task, lattice.field(), sink, stream);
  Counters found = counters(stream);
  found.covered += settled.covered;
  return found;
}

const int4* Gather::maps_of(const StepLattice& lattice, const SlabBox& box, cudaStream_t stream) {
  constexpr std::int64_t kMostBytes = 4;  // for each voxel
  const std::int64_t entries = entries_of(lattice);
  if (entries * std::int64_t{kMapQuads * sizeof(int4)} > kMostBytes * box.count()) return nullptr;
  int4* maps = maps_.reserve(static_cast<std::size_t>(entries * kMapQuads));
  if (!has_maps_) {
    map_table_kernel<<<blocks_for(entries), kThreads, 0, stream>>>(lattice, entries, maps);
    TETWARP_CUDA_TRY(cudaGetLastError());
    has_maps_ = true;
  }
  return maps;
}

bool Gather::is_mostly_folded(const LatticeOnDevice& lattice) {
  constexpr std::int64_t kFew = 256;  // one inverted tetrahedron in so many
  const std::int64_t tetrahedra = kTetrahedraPerCell * lattice.field().cell_count();
  return static_cast<std::int64_t>(lattice.statistics().inverted) > tetrahedra / kFew;
}

Gather::Counters Gather::counters(cudaStream_t stream) { return fetch(coverage_.counters(), found_, stream); }

/// So many slices at a time that memory for their claimed voxels is bounded.
template <class Task, class Sink>
void Gather::claim_several(const Task& task, const DeviceField& field, const Sink& sink, cudaStream_t stream) {
  const glm::i64vec3& size = task.box.size;
  const auto slices = static_cast<std::size_t>(size.z);
  unsigned* in_slice = several_in_slice_.reserve(slices);
  TETWARP_CUDA_TRY(cudaMemcpyAsync(in_slice, coverage_.several_in_slice(), slices * sizeof(unsigned),
                                   cudaMemcpyDeviceToHost, stream));
  TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  const std::int64_t words_per_slice = coverage_.words_per_row() * size.y;
  for (std::int64_t z = 0, end; z < size.z; z = end) {
    std::size_t count = in_slice[z];
    for (end = z + 1; end < size.z; ++end) {
      const std::size_t next = in_slice[end];
      if (count + next > kClaimedAtOnce) break;
      count += next;
    }
    if (count == 0) continue;
    const SlabBox slab{task.box.begin + glm::i64vec3(0, 0, z), {size.x, size.y, end - z}};
    const std::int64_t words = words_per_slice * slab.size.z;
    unsigned *rank = coverage_.scratch(), *voxels = claimed_.reserve(count);
    const Wanted wanted{coverage_.several() + z * words_per_slice, rank};
    numbered_.fill(0, 1, stream);
    number_kernel<<<blocks_for(words), kThreads, 0, stream>>>(wanted.bits, words, rank, numbered_.data(), voxels);
    claims_.claim(field, slab, wanted, count, stream);
    write_claimed_kernel<<<blocks_for(static_cast<std::int64_t>(count)), kThreads, 0, stream>>>(
        task, glm::ivec3(slab.begin), voxels, static_cast<unsigned>(count), claims_.owner(), sink);
    TETWARP_CUDA_TRY(cudaGetLastError());
  }
}

#define TETWARP_RUN(...)                                                                                          \
  template Gather::Counters Gather::run(const LatticeOnDevice&, const SlabBox&, const __VA_ARGS__&, cudaStream_t, \
                                        const TileReuse&)
TETWARP_FOR_EACH_SINK(TETWARP_RUN, Lerp::separate);
TETWARP_FOR_EACH_SINK(TETWARP_RUN, Lerp::fused);
#undef TETWARP_RUN
template Gather::Counters Gather::run_intervals(const LatticeOnDevice&, const SlabBox&, const OwnerSink&, cudaStream_t,
                                                const TileReuse&);

}  // namespace tetwarp::cuda_detail
