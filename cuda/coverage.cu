#include "cuda/coverage.h"
#include "deform/core/border.h"
#include "deform/core/gather.h"

namespace tetwarp::cuda_detail {

namespace {

struct Crossings {
  std::uint32_t *ins, *outs;
  int *start, *collided;
  int words;
};

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
      if (atomicOr(&words[row * out.words + (first - begin) / 32], bit) & bit) out.collided[row] = 1;
    }
  }
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

/// One thread a triangle of the border.
__global__ void border_kernel(StepLattice lattice, Sides sides, Nudge nudge, SlabBox box, Crossings out) {
  const std::int64_t number = std::int64_t{blockIdx.x} * kThreads + threadIdx.x;
  if (number >= sides.first[6]) return;
  int side = 0;
  while (number >= sides.first[side + 1]) ++side;
  const auto n = static_cast<int>(number - sides.first[side]);
  const int axis = side / 2, across = lattice.cells[(axis + 1) % 3];
  const BorderTriangle t = border_triangle(lattice, axis, side % 2 == 1, {n / 2 % across, n / 2 / across}, n % 2);
  Box around{t.a, t.a};
  around.grow(t.b);
  around.grow(t.c);
  if (around.low.y == around.high.y || around.low.z == around.high.z) return;  // no row passes through
  VoxelBox rows{box.begin, box.begin + box.size};
  for (int i = 1; i < 3; ++i) detail::candidates(nudge, i, around.low[i], around.high[i], &rows.begin[i], &rows.end[i]);
  if (rows.end.y <= rows.begin.y || rows.end.z <= rows.begin.z) return;
  const glm::ivec2 from(rows.begin.y, rows.begin.z), to(rows.end.y - 1, rows.end.z - 1);
  if (fits_double(around)) {
    cross_rows<double>(t, nudge, box, from, to, out);
  } else if (fits_int64(around)) {
    cross_rows<std::int64_t>(t, nudge, box, from, to, out);
  } else {
    cross_rows<Wide>(t, nudge, box, from, to, out);
  }
}

/// One warp a row: from crossings to the winding number of every voxel.
__global__ void wind_kernel(Crossings in, std::int64_t rows, int width, std::uint32_t* single, std::uint32_t* several) {
  const std::int64_t row = (std::int64_t{blockIdx.x} * kThreads + threadIdx.x) / 32;
  const int lane = static_cast<int>(threadIdx.x & 31);
  if (row >= rows) return;
  const bool collided = in.collided[row] != 0;
  int carried = in.start[row];
  for (int first = 0; first < in.words; first += 32) {
    const int word = first + lane;
    const bool here = word < in.words;
    const std::uint32_t ins = here ? in.ins[row * in.words + word] : 0;
    const std::uint32_t outs = here ? in.outs[row * in.words + word] : 0;
    const int change = __popc(ins) - __popc(outs);
    int sum = change;
    for (int step = 1; step < 32; step *= 2) {
      const int below = __shfl_up_sync(~0u, sum, step);
      if (lane >= step) sum += below;
    }
    int winding = carried + sum - change;
    std::uint32_t one = 0, more = 0;
    int from = 0;  // bits from here on have the winding number so far
    for (std::uint32_t events = ins | outs; from < 32; events &= events - 1) {
      const int next = events != 0 ? __ffs(static_cast<int>(events)) - 1 : 32;
      const std::uint32_t bits = (next == 32 ? ~0u : (1u << next) - 1) & (~0u << from);
      one |= winding == 1 ? bits : 0;
      more |= winding != 1 && winding != 0 ? bits : 0;
      if (next < 32) winding += static_cast<int>(ins >> next & 1) - static_cast<int>(outs >> next & 1);
      from = next;
    }
    const int left = width - word * 32;
    const std::uint32_t valid = left >= 32 ? ~0u : (left > 0 ? (1u << left) - 1 : 0);
    if (here) {
      single[row * in.words + word] = collided ? 0 : one & valid;
      several[row * in.words + word] = collided ? valid : more & valid;
    }
    carried += __shfl_sync(~0u, sum, 31);
  }
}

/// One warp a word of flagged cells: voxels that an inverted tetrahedron owns go from `single` to `several`.
__global__ void inverted_kernel(StepLattice lattice, Nudge nudge, BitRows inverted_cells, SlabBox box, int words,
                                std::uint32_t* single, std::uint32_t* several) {
  const std::int64_t n = (std::int64_t{blockIdx.x} * kThreads + threadIdx.x) / 32;
  const std::int64_t per_row = inverted_cells.words_per_row;
  if (n >= per_row * lattice.cells.y * lattice.cells.z) return;
  const int lane = static_cast<int>(threadIdx.x & 31);
  if ((inverted_cells.words[n] >> lane & 1) == 0) return;
  const glm::ivec3 at(n % per_row / 2 * 64 + n % per_row % 2 + 2 * lane, n / per_row % lattice.cells.y,
                      n / per_row / lattice.cells.y);
  const VoxelBox region{box.begin, box.begin + box.size};
#pragma unroll 1
  for (int number = 0; number < kTetrahedraPerCell; ++number) {
    const LatticeTetrahedron t = LatticeTetrahedron::of_cell(at, number);
    if (jacobian(vertices_of(lattice, t)) > 0) continue;
    visit_tetrahedron(lattice, t, region, nudge, [&](const glm::ivec3& voxel) {
      const glm::i64vec3 in = glm::i64vec3(voxel) - box.begin;
      const std::int64_t word = (in.z * box.size.y + in.y) * words + in.x / 32;
      const std::uint32_t bit = 1u << (in.x & 31);
      atomicAnd(&single[word], ~bit);
      atomicOr(&several[word], bit);
    });
  }
}

}  // namespace

void Coverage::find(const DeviceField& field, const BitRows& inverted_cells, bool any_inverted, const SlabBox& box,
                    cudaStream_t stream) {
  words_ = static_cast<int>((box.size.x + 31) / 32);
  const std::int64_t rows = box.size.y * box.size.z;
  const auto words = static_cast<std::size_t>(rows * words_);
  ins_.fill(0, words, stream);
  outs_.fill(0, words, stream);
  start_.fill(0, static_cast<std::size_t>(rows), stream);
  collided_.fill(0, static_cast<std::size_t>(rows), stream);
  const Crossings crossings{ins_.data(), outs_.data(), start_.data(), collided_.data(), words_};
  const Sides sides(field.steps.cells);
  border_kernel<<<blocks_for(sides.first[6]), kThreads, 0, stream>>>(field.steps, sides, field.frame.nudge, box,
                                                                     crossings);
  std::uint32_t *single = single_.reserve(words), *several = several_.reserve(words);
  wind_kernel<<<blocks_for(rows * 32), kThreads, 0, stream>>>(crossings, rows, static_cast<int>(box.size.x), single,
                                                              several);
  if (any_inverted) {
    const std::int64_t flags = inverted_cells.words_per_row * field.frame.cells.y * field.frame.cells.z;
    inverted_kernel<<<blocks_for(flags * 32), kThreads, 0, stream>>>(field.steps, field.frame.nudge, inverted_cells,
                                                                     box, words_, single, several);
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

}  // namespace tetwarp::cuda_detail
