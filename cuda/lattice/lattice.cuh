// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>

#include "cuda/runtime/device_buffer.h"
#include "deform/core/lattice_vertex.h"
#include "deform/core/step_lattice.h"
#include "deform/vertex_field.h"

namespace tetwarp::cuda_detail {

constexpr int kThreads = 128;
inline unsigned blocks_for(std::int64_t count) { return static_cast<unsigned>((count + kThreads - 1) / kThreads); }

/// A box of bits, one for each element. Each row begins at a word.
struct BitRows {
  const std::uint32_t* words;
  int words_per_row;
};

/// Mask of those bits of a word of a row that lie from `first` to `last` of the row, both included; the word must
/// contain some of them.
__device__ inline std::uint32_t bits_of_word(int word, int first, int last) {
  std::uint32_t mask = ~0u;
  if (word == first / 32) mask &= ~0u << (first & 31);
  if (word == last / 32) mask &= ~0u >> (31 - (last & 31));
  return mask;
}

/// Position of element number n in a box of this size, i fastest.
__host__ __device__ inline glm::i64vec3 unravel(std::int64_t n, const glm::i64vec3& size) {
  return {n % size.x, n / size.x % size.y, n / (size.x * size.y)};
}

/// Sum over a warp, or over groups of `lanes` lanes (a power of two), returned in every lane.
__device__ inline unsigned warp_sum(unsigned value, int lanes = 32) {
  for (int step = lanes / 2; step > 0; step /= 2) value += __shfl_xor_sync(~0u, value, step);
  return value;
}

/// The smallest, and the largest, over a whole warp, in every lane.
template <class T>
__device__ T warp_min(T value) {
  for (int step = 16; step > 0; step /= 2) value = min(value, __shfl_xor_sync(~0u, value, step));
  return value;
}
template <class T>
__device__ T warp_max(T value) {
  for (int step = 16; step > 0; step /= 2) value = max(value, __shfl_xor_sync(~0u, value, step));
  return value;
}

/// Sum over the lanes of a group of `lanes` lanes (a power of two) up to and including this one.
__device__ inline int warp_scan(int value, int lanes = 32) {
  const int lane = static_cast<int>(threadIdx.x) & (lanes - 1);
  for (int step = 1; step < lanes; step *= 2) {
    const int below = __shfl_up_sync(~0u, value, step, lanes);
    if (lane >= step) value += below;
  }
  return value;
}

/// Adds 1 for every thread of the warp whose condition holds.
__device__ inline void warp_count(unsigned long long* counter, bool condition) {
  const unsigned active = __activemask();
  const unsigned votes = __ballot_sync(active, condition);
  if (votes != 0 && (threadIdx.x & 31) == __ffs(static_cast<int>(active)) - 1) {
    atomicAdd(counter, static_cast<unsigned long long>(__popc(votes)));
  }
}

/// A field as kernels see it: snapped vertices, in one of two forms.
struct DeviceField {
  LatticeFrame frame;
  StepLattice steps;                 ///< the form that is used where `packed` is not null
  const Vertex* vertices = nullptr;  ///< the form that is used otherwise

  bool has_steps() const { return steps.packed != nullptr; }
  __device__ glm::i64vec3 cell_at(std::int64_t number) const { return unravel(number, frame.cells); }
  __device__ Vertex vertex(const glm::i64vec3& at) const {
    if (!vertices) return steps.vertex(glm::ivec3(at));
    return vertices[(at.z * (frame.cells.y + 1) + at.y) * (frame.cells.x + 1) + at.x];
  }
  __device__ Cell cell(const glm::i64vec3& at) const {
    Cell cell;
#pragma unroll
    for (int c = 0; c < 8; ++c) cell.corner[c] = vertex(at + glm::i64vec3(c & 1, c >> 1 & 1, c >> 2));
    return cell;
  }
  __host__ __device__ static bool is_odd(const glm::i64vec3& at) { return ((at.x + at.y + at.z) & 1) != 0; }
  __host__ __device__ std::int64_t cell_count() const { return frame.cells.x * frame.cells.y * frame.cells.z; }
};

/// For each block of 8 x 8 x 8 vertices, whether any is displaced.
struct MovingBlocks {
  static constexpr int kSide = 8;

  glm::ivec3 count{0};
  std::uint8_t* moving = nullptr;  ///< one byte for each block, i fastest; null: not known

  __device__ std::uint8_t& at(const glm::ivec3& vertex) const {
    return moving[((vertex.z / kSide) * count.y + vertex.y / kSide) * count.x + vertex.x / kSide];
  }
};

/// Pairs of vertices side by side along i near which tetrahedra are inverted: those around either that lie between it
/// and its neighbours on every axis, or the centres of the cells from them on.
///
/// A word has the pairs of 62 columns and of one more to either side; they begin one column later in odd rows.
struct InvertedPairs {
  static constexpr int kColumns = 62;

  int words_per_row = 0, rows = 0;  ///< rows of a slice
  std::uint32_t* words = nullptr;

  InvertedPairs() = default;
  explicit InvertedPairs(const StepLattice& lattice)
      : words_per_row((lattice.cells.x + 1 + kColumns) / kColumns), rows(lattice.cells.y + 1) {}
  __host__ __device__ std::int64_t word(int row, int slice, int n) const {
    return (std::int64_t{slice} * rows + row) * words_per_row + n;
  }
  /// The first vertex of a pair, which may lie outside the lattice.
  __device__ static int column(int row, int word, int bit) { return word * kColumns - 2 + 2 * bit + (row & 1); }
};

/// What one pass over the cells of a field finds.
struct FieldStatistics {
  std::uint64_t inverted = 0, degenerate = 0;
  double jacobian_min = INFINITY, jacobian_max = -INFINITY;
};

struct LatticeFindings;  // findings.cuh

/// Owner of a field on the device. It snaps the vertices and describes the cells.
class LatticeOnDevice {
 public:
  /// @param displacement  on the device
  /// @param room          null, or room for 8 bytes a vertex, which may be where the displacements are: what is held of
  ///                      the vertices goes there where it can. Where it cannot, the displacements are not touched
  /// @param wants_range   whether `statistics` has the range of Jacobian determinants
  /// @throws InputError for a vertex that is not finite or too far away
  void set(const LatticeFrame& frame, const Geometry& output, const glm::vec3* displacement, std::uint64_t* room,
           bool wants_range, cudaStream_t stream);

  const DeviceField& field() const { return field_; }
  const FieldStatistics& statistics() const { return statistics_; }
  /// Where the vertices rest at whole steps.
  const InvertedPairs& inverted() const { return inverted_; }
  /// Where the vertices rest at whole steps.
  const MovingBlocks& moving_blocks() const { return blocks_; }

  /// Box around the undeformed places of all cells that may reach a region: low and high corner, 2^-12 voxel; low
  /// exceeds high where there is no such cell.
  void reach(const glm::i64vec3& begin, const glm::i64vec3& end, int (&low_high)[6], cudaStream_t stream) const;

 private:
  bool set_steps(StepLattice lattice, const glm::vec3* displacement, std::uint64_t* room, bool wants_range,
                 LatticeFindings& found, cudaStream_t stream);
  void set_vertices(const glm::vec3* displacement, std::int64_t vertices, LatticeFindings& found, cudaStream_t stream);
  /// Room for what is found of a field, all zero, with one fill; after it so many words and bytes.
  LatticeFindings* clear_notes(std::size_t words, std::size_t bytes, cudaStream_t stream);
  LatticeFindings read_findings(cudaStream_t stream);

  DeviceField field_;
  FieldStatistics statistics_;
  DeviceBuffer<Vertex> vertices_;
  DeviceBuffer<std::uint64_t> packed_;
  StepPacking packing_;  ///< packing of the last field that was packed
  DeviceBuffer<int> range_;
  DeviceBuffer<std::byte> notes_;  ///< LatticeFindings; then the words of `inverted_`, and the bytes of `blocks_`
  PinnedBuffer<LatticeFindings> found_;
  InvertedPairs inverted_;
  MovingBlocks blocks_;
};

}  // namespace tetwarp::cuda_detail
