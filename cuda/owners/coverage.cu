// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/owners/coverage.cuh"

#include "cuda/runtime/warp.cuh"
#include "deform/core/border.h"
#include "deform/core/gather.h"

namespace tetwarp::cuda_detail {

namespace {

constexpr int kBlock = 4;  ///< rows and slices of vertices that are looked at together for what is inverted
constexpr int kPairs = 4;  ///< pairs of a word of `InvertedPairs` that a warp looks at together
constexpr unsigned kMostExtra = 1u << 18;
constexpr int kNoExtra = 0, kLostExtra = -1;

/// Where rows of voxels pass through the border: what `border_kernel` writes by atomics, and `wind_kernel` reads.
///
///     a row      voxel  0  1  2  3  4  5  6  7     the border lies before voxels 2, 3 and 6, and before the box
///     ins               .  .  1  1  .  .  .  .     here the row enters: the winding number grows by 1
///     outs              .  .  .  .  .  .  1  .     here it leaves
///     start             1                          winding number at voxel 0
///     winding           1  1  2  3  3  3  2  2
///
/// A second crossing of one kind before one voxel does not fit into a bit: it is chained to its row, as `extra`.
struct Crossings {
  std::uint32_t *ins, *outs;  ///< a bit for each voxel, each row from a word on
  int* start;                 ///< of each row
  int words;                  ///< a row
  int* extra_of_row;          ///< first of a chain, numbered from 1; kNoExtra, or kLostExtra where some found no room
  ExtraCrossing* extra;       ///< room for kMostExtra
  unsigned* extra_count;      ///< how many there are, those without room too

  __device__ void add_extra(std::int64_t row, int voxel, int sign) const {
    const unsigned n = atomicAdd(extra_count, 1u);
    if (n < kMostExtra) {
      extra[n].voxel = voxel;
      extra[n].sign = sign;
      extra[n].next = atomicExch(&extra_of_row[row], static_cast<int>(n + 1));
    } else {
      atomicExch(&extra_of_row[row], kLostExtra);
    }
  }
};

/// Marks where the rows of a range pass through a triangle.
/// @param low, high  first and last row: j and k of the output
template <class Int>
__device__ void cross_rows(const BorderTriangle& t, const Nudge& nudge, const SlabBox& box, const glm::ivec2& low,
                           const glm::ivec2& high, const Crossings& out) {
  const int begin = static_cast<int>(box.begin.x), end = static_cast<int>(box.begin.x + box.size.x);
  for (int z = low.y; z <= high.y; ++z) {
    for (int y = low.x; y <= high.x; ++y) {
      int first = 0;
      const int sign = cross_border<Int>(t, nudge, y, z, begin, end, first);
      if (sign == 0 || first == end) continue;
      const std::int64_t row = (z - box.begin.z) * box.size.y + (y - box.begin.y);
      if (first == begin) {
        atomicAdd(&out.start[row], sign);
        continue;
      }
      const std::uint32_t bit = 1u << ((first - begin) & 31);
      std::uint32_t* words = sign > 0 ? out.ins : out.outs;
      if (atomicOr(&words[row * out.words + (first - begin) / 32], bit) & bit) out.add_extra(row, first - begin, sign);
    }
  }
}

/// `cross_rows` for large triangles, which are few: out of line, so that registers suffice for many threads.
template <class Int>
__device__ __noinline__ void cross_rows_apart(BorderTriangle t, const Nudge& nudge, const SlabBox& box, glm::ivec2 low,
                                              glm::ivec2 high, const Crossings& out) {
  cross_rows<Int>(t, nudge, box, low, high, out);
}

/// How the triangles of the six sides of the border are numbered.
struct Sides {
  std::int64_t first[7];  ///< of each side; the last is their number

  explicit Sides(const glm::ivec3& cells) : first{} {
    for (int side = 0; side < 6; ++side) {
      const int axis = side / 2;
      first[side + 1] = first[side] + 2 * std::int64_t{cells[(axis + 1) % 3]} * cells[(axis + 2) % 3];
    }
  }
};

/// Marks where rows of voxels pass through the border; a thread a triangle of it.
///
/// @param sides  how triangles are numbered: those across i, j and k, two sides each, two triangles a face of a cell
/// @param turns  of the same nudge  @param box  whose rows are looked at
/// @param out    all zero before; written by atomics, whose order does not matter
__global__ void __launch_bounds__(kThreads, 8)
    border_kernel(const __grid_constant__ StepLattice lattice, const __grid_constant__ Sides sides,
                  const __grid_constant__ Nudge nudge, const __grid_constant__ NudgeTurns turns,
                  const __grid_constant__ SlabBox box, const __grid_constant__ Crossings out) {
  const std::int64_t number = thread_of_grid();
  if (number >= sides.first[6]) return;
  int side = 0;
  while (number >= sides.first[side + 1]) ++side;
  const auto n = static_cast<unsigned>(number - sides.first[side]);
  const auto on_axis = [&](int axis) {
    const auto across = static_cast<unsigned>(lattice.cells[(axis + 1) % 3]);
    return border_triangle(lattice, axis, side % 2 == 1, {n / 2 % across, n / 2 / across}, n % 2);
  };
  // With the axis known when compiled, no vector is indexed at run time.
  const BorderTriangle t = side < 2 ? on_axis(0) : (side < 4 ? on_axis(1) : on_axis(2));
  Box around{t.a, t.a};
  around.grow(t.b);
  around.grow(t.c);
  if (around.low.y == around.high.y || around.low.z == around.high.z) return;  // no row passes through
  const glm::ivec3 begin(box.begin), end(box.begin + box.size);
  glm::ivec2 from(begin.y, begin.z), to(end.y, end.z);
  for (int i = 1; i < 3; ++i) cut_to_candidates(turns, i, around.low[i], around.high[i], from[i - 1], to[i - 1]);
  to -= 1;
  if (to.x < from.x || to.y < from.y) return;
  if (fits_double(around)) {
    cross_rows<double>(t, nudge, box, from, to, out);
  } else if (fits_int64(around)) {
    cross_rows_apart<std::int64_t>(t, nudge, box, from, to, out);
  } else {
    cross_rows_apart<Wide>(t, nudge, box, from, to, out);
  }
}

/// The extra crossings of a row.
struct Chain {
  const ExtraCrossing* extra;
  int first;

  /// What they add to the winding number within [begin, end) of the row.
  __device__ int sum(int begin, int end) const {
    int sum = 0;
    for (int n = first; n > 0; n = extra[n - 1].next)
      if (extra[n - 1].voxel >= begin && extra[n - 1].voxel < end) sum += extra[n - 1].sign;
    return sum;
  }
  __device__ bool is_whole() const {
    int n = first;
    while (n > 0) n = extra[n - 1].next;
    return n == kNoExtra;
  }
};

/// The winding numbers of the 32 voxels of a word: which are 1, and which neither 0 nor 1.
struct WordWinding {
  std::uint32_t one = 0, more = 0;

  /// Goes from crossing to crossing: all bits up to the next one have the winding number so far.
  /// @param winding  before the first voxel of the word  @param word  its number in the row
  __device__ WordWinding(int winding, std::uint32_t ins, std::uint32_t outs, bool has_extra, const Chain& chain,
                         int word) {
    int from = 0;
    for (std::uint32_t events = ins | outs; from < 32; events &= events - 1) {
      const int next = events != 0 ? first_bit(events) : 32;
      const std::uint32_t bits = (next == 32 ? ~0u : bits_below(next)) & (~0u << from);
      one |= winding == 1 ? bits : 0;
      more |= winding != 1 && winding != 0 ? bits : 0;
      if (next < 32) winding += static_cast<int>(ins >> next & 1) - static_cast<int>(outs >> next & 1);
      if (next < 32 && has_extra) winding += chain.sum(word * 32 + next, word * 32 + next + 1);
      from = next;
    }
  }
};

/// From crossings to the winding number of every voxel. Some lanes of a warp share a row, a word each: a scan over them
/// gives each the winding number before its word. Warps are whole: lanes beyond the last row look at it again.
///
/// @param rows            of the box, and how many of them a slice has  @param width  voxels of a row
/// @param lanes           that share a row: a power of two, at most 32
/// @param single, several a bit for each voxel, written: one owner; perhaps several, or none known
/// @param in_slice        for each slice, how many bits of `several` are set: added
/// @param in_box          in all: added
__global__ void wind_kernel(Crossings in, std::int64_t rows, int rows_per_slice, int width, int lanes,
                            std::uint32_t* single, std::uint32_t* several, unsigned* in_slice,
                            unsigned long long* in_box) {
  const std::int64_t number = thread_of_grid() / lanes, row = min(number, rows - 1);
  const int lane = static_cast<int>(threadIdx.x) & (lanes - 1);
  const bool has_row = number < rows;
  const Chain chain{in.extra, in.extra_of_row[row]};
  const bool has_extra = chain.first != kNoExtra, known = !has_extra || chain.is_whole();
  int carried = in.start[row];
  unsigned found = 0;
  for (int first = 0; first < in.words; first += lanes) {
    const int word = first + lane;
    const bool here = has_row && word < in.words;
    const std::uint32_t ins = here ? in.ins[row * in.words + word] : 0;
    const std::uint32_t outs = here ? in.outs[row * in.words + word] : 0;
    int change = __popc(ins) - __popc(outs);
    if (has_extra) change += chain.sum(word * 32, word * 32 + 32);
    const int sum = group_scan(change, lanes);
    const WordWinding found_here(carried + sum - change, ins, outs, has_extra, chain, word);
    const int left = width - word * 32;
    const std::uint32_t valid = left >= 32 ? ~0u : (left > 0 ? bits_below(left) : 0);
    if (here) {
      const std::uint32_t more = known ? found_here.more & valid : valid;
      single[row * in.words + word] = known ? found_here.one & valid : 0;
      several[row * in.words + word] = more;
      found += static_cast<unsigned>(__popc(more));
    }
    carried += __shfl_sync(kAllLanes, sum, lanes - 1, lanes);
  }
  found = group_sum(found, lanes);
  if (lane != 0 || found == 0) return;
  atomicAdd(&in_slice[row / rows_per_slice], found);
  atomicAdd(in_box, static_cast<unsigned long long>(found));
}

/// The voxels that have become `several`.
struct SeveralMarker {
  IntBox region;  ///< of the bits
  int words;      ///< a row
  std::uint32_t *single, *several;

  /// By atomics, for words are shared with other warps. The lanes of a warp share out the words.
  __device__ void mark(const IntBox& voxels, int lane) const {
    if (voxels.is_empty()) return;
    const glm::ivec3 first = voxels.begin - region.begin, last = voxels.end - region.begin - 1;
    const glm::ivec3 size(last.x / 32 - first.x / 32 + 1, last.y - first.y + 1, last.z - first.z + 1);
    for (int n = lane; n < size.x * size.y * size.z; n += 32) {
      const glm::ivec3 at = glm::ivec3(first.x / 32, first.y, first.z) + position_in(n, size);
      const std::int64_t word = (std::int64_t{at.z} * (region.end.y - region.begin.y) + at.y) * words + at.x;
      const std::uint32_t mask = bits_of_word(at.x, first.x, last.x);
      if ((several[word] & mask) == mask) continue;
      atomicAnd(&single[word], ~mask);
      atomicOr(&several[word], mask);
    }
  }
};

/// How many bits each slice has: some thread blocks a slice, grid (blocks of a slice, slices).
///
/// @param bits      row after row, slice after slice  @param in_slice, in_box  counts that are added to: 0 before
__global__ void count_kernel(const std::uint32_t* bits, int words_per_slice, unsigned* in_slice,
                             unsigned long long* in_box) {
  unsigned found = 0;
  const std::uint32_t* slice = bits + std::int64_t{blockIdx.y} * words_per_slice;
  for (int n = static_cast<int>(blockIdx.x * kThreads + threadIdx.x); n < words_per_slice; n += gridDim.x * kThreads)
    found += static_cast<unsigned>(__popc(slice[n]));
  found = warp_sum(found);
  if (lane_of_warp() != 0 || found == 0) return;
  atomicAdd(&in_slice[blockIdx.y], found);
  atomicAdd(in_box, static_cast<unsigned long long>(found));
}

/// All voxels that inverted tetrahedra may reach go to `several`. A warp looks at a word of pairs on kBlock rows of as
/// many slices, and mostly finds nothing. Where it does, its lanes share out the vertices around kPairs pairs at a
/// time:
///
///     a word of `InvertedPairs`, 32 pairs:   step 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7   four pairs each
///
/// @param inverted  which pairs, from `step_pass_kernel`  @param warps  how many are needed
/// @param marker    its bits are written
__global__ void inverted_kernel(const __grid_constant__ StepLattice lattice, const __grid_constant__ NudgeTurns turns,
                                const __grid_constant__ InvertedPairs inverted, std::int64_t warps,
                                const __grid_constant__ SeveralMarker marker) {
  constexpr int kLargeBox = 4096;  // voxels: then row by row
  constexpr int kLanesAlong = 16;  // lanes that share a row of vertices
  static_assert(kBlock * kBlock <= 32);
  const std::int64_t n = warp_of_grid();
  if (n >= warps) return;
  const int lane = lane_of_warp(), rows = (inverted.rows + kBlock - 1) / kBlock;
  const int word = static_cast<int>(n % inverted.words_per_row);
  const glm::ivec2 first(n / inverted.words_per_row % rows * kBlock, n / inverted.words_per_row / rows * kBlock);
  const auto whole_box = [&](unsigned pairs, const glm::ivec2& from_row, const glm::ivec2& to_row) {
    const int low = first_bit(pairs), high = last_bit(pairs);
    const glm::ivec3 from =
        glm::max(glm::ivec3(InvertedPairs::column(0, word, low), from_row.x, from_row.y) - 1, glm::ivec3(0));
    const glm::ivec3 to =
        glm::min(glm::ivec3(InvertedPairs::column(1, word, high) + 2, to_row.x + 1, to_row.y + 1), lattice.cells);
    static_assert(2 * kPairs + 4 <= kLanesAlong);  // so many columns at most
    const int x = min(from.x + lane % kLanesAlong, to.x);
    Box box{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
    for (int z = from.z; z <= to.z; ++z) {
      for (int y = from.y + lane / kLanesAlong; y <= to.y; y += 32 / kLanesAlong) box.grow(lattice.deformed({x, y, z}));
    }
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = __shfl_sync(kAllLanes, warp_min(box.low[axis]), 0);
      box.high[axis] = __shfl_sync(kAllLanes, warp_max(box.high[axis]), 0);
    }
    return candidates(turns, box.low, box.high, marker.region);
  };
  const glm::ivec2 own = first + glm::ivec2(lane % kBlock, lane / kBlock % kBlock);
  const bool here = lane < kBlock * kBlock && own.x < inverted.rows && own.y <= lattice.cells.z;
  const unsigned pairs = here ? inverted.words[inverted.word(own.x, own.y, word)] : 0;
  if (!__any_sync(kAllLanes, pairs != 0)) return;
  for (int shift = 0; shift < 32; shift += kPairs) {
    const unsigned mine = pairs & ((1u << kPairs) - 1) << shift;
    unsigned any = 0;
    for (int pair = 0; pair < kPairs; ++pair) {
      const unsigned bit = 1u << (shift + pair);
      any |= __any_sync(kAllLanes, (mine & bit) != 0) ? bit : 0;
    }
    if (any == 0) continue;
    const IntBox all = whole_box(any, first, first + kBlock - 1);
    if (all.is_empty()) continue;
    const glm::ivec3 size = all.end - all.begin;
    if (std::int64_t{size.x} * size.y * size.z <= kLargeBox) {
      marker.mark(all, lane);
      continue;
    }
    for (unsigned holders = __ballot_sync(kAllLanes, mine != 0); holders != 0; holders &= holders - 1) {
      const int holder = first_bit(holders);
      const glm::ivec2 at = first + glm::ivec2(holder % kBlock, holder / kBlock);
      for (unsigned left = __shfl_sync(kAllLanes, mine, holder); left != 0; left &= left - 1)
        marker.mark(whole_box(left & (~left + 1), at, at), lane);
    }
  }
}

}  // namespace

void Coverage::begin(const SlabBox& box, cudaStream_t stream) {
  words_ = static_cast<int>((box.size.x + 31) / 32);
  const auto rows = static_cast<std::size_t>(box.size.y * box.size.z), slices = static_cast<std::size_t>(box.size.z);
  const std::size_t words = rows * static_cast<std::size_t>(words_);
  crossings_.fill(0, kCounterWords + 2 * words + 2 * rows + slices + 1, stream);
  in_slice_ = ins() + 2 * words + 2 * rows;
  single_.reserve(words);
  several_.reserve(words);
}

void Coverage::forget(const SlabBox& box, cudaStream_t stream) {
  begin(box, stream);
  const auto words = static_cast<std::size_t>(box.size.y * box.size.z * words_);
  single_.fill(0, words, stream);
  several_.fill(0, words, stream);
}

void Coverage::find(const LatticeOnDevice& lattice, const SlabBox& box, cudaStream_t stream) {
  const DeviceField& field = lattice.field();
  const std::int64_t rows = box.size.y * box.size.z;
  const auto words = static_cast<std::size_t>(rows * words_);
  const auto row_count = static_cast<std::size_t>(rows), slices = static_cast<std::size_t>(box.size.z);
  std::uint32_t *starts = ins() + 2 * words, *chains = starts + row_count;
  const Crossings crossings{ins(),
                            ins() + words,
                            reinterpret_cast<int*>(starts),
                            words_,
                            reinterpret_cast<int*>(chains),
                            extra_.reserve(kMostExtra),
                            in_slice_ + slices};
  const Sides sides(field.steps.cells);
  border_kernel<<<blocks_for(sides.first[6]), kThreads, 0, stream>>>(field.steps, sides, field.frame.nudge,
                                                                     NudgeTurns(field.frame.nudge), box, crossings);
  std::uint32_t *single = single_.data(), *several = several_.data();
  int lanes = 32;
  while (lanes > 1 && lanes / 2 >= words_) lanes /= 2;
  wind_kernel<<<blocks_for(rows * lanes), kThreads, 0, stream>>>(crossings, rows, static_cast<int>(box.size.y),
                                                                 static_cast<int>(box.size.x), lanes, single, several,
                                                                 in_slice_, &counters()->claimed);
  if (lattice.statistics().inverted != 0) {
    const InvertedPairs& inverted = lattice.inverted();
    const IntBox region{glm::ivec3(box.begin), glm::ivec3(box.begin + box.size)};
    const std::int64_t warps = std::int64_t{inverted.words_per_row} * ((inverted.rows + kBlock - 1) / kBlock) *
                               (field.steps.cells.z / kBlock + 1);
    inverted_kernel<<<blocks_for(warps * 32), kThreads, 0, stream>>>(
        field.steps, NudgeTurns(field.frame.nudge), inverted, warps, {region, words_, single, several});
    count_several(box, stream);
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void Coverage::count_several(const SlabBox& box, cudaStream_t stream) {
  unsigned long long* several_in_box = &counters()->claimed;
  const auto slices = static_cast<std::size_t>(box.size.z);
  TETWARP_CUDA_TRY(cudaMemsetAsync(in_slice_, 0, slices * sizeof(unsigned), stream));
  TETWARP_CUDA_TRY(cudaMemsetAsync(several_in_box, 0, sizeof *several_in_box, stream));
  count_kernel<<<dim3(16, static_cast<unsigned>(slices)), kThreads, 0, stream>>>(
      several_.data(), static_cast<int>(words_ * box.size.y), in_slice_, several_in_box);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
