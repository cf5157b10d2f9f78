// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>

#include "cuda/runtime/device_buffer.h"
#include "cuda/runtime/launch.cuh"
#include "deform/core/lattice_vertex.h"
#include "deform/core/step_lattice.h"
#include "deform/vertex_field.h"

namespace tetwarp::cuda_detail {

/// Position of element number n in a box of this size, i fastest.
__host__ __device__ inline glm::i64vec3 unravel(std::int64_t n, const glm::i64vec3& size) {
  return {n % size.x, n / size.x % size.y, n / (size.x * size.y)};
}

/// `unravel` in 32 bits.
__host__ __device__ inline glm::ivec3 position_in(int n, const glm::ivec3& size) {
  return {n % size.x, n / size.x % size.y, n / (size.x * size.y)};
}

/// A step is 2^-kStepBits voxel: `steps >> kStepBits` are whole voxels, rounded down.
constexpr int kStepBits = 12;
static_assert(1 << kStepBits == kStepsPerVoxel);

/// Corner c of a cell, as a step along each axis: c is x + 2 y + 4 z.
__host__ __device__ inline glm::ivec3 corner_of_cell(int c) { return {c & 1, c >> 1 & 1, c >> 2}; }

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
    for (int c = 0; c < 8; ++c) cell.corner[c] = vertex(at + glm::i64vec3(corner_of_cell(c)));
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
/// A word has the pairs of 62 columns and of one more to either side, so that the words of neighbouring warps overlap
/// by two columns; they begin one column later in odd rows:
///
///     bit             0         1        2              30        31
///     columns, n = 0  -2 -1     0  1     2  3    ...    58 59     60 61     of an even row
///                        -1  0     1  2     3  4  ...      59 60     61 62  of an odd row
///     n = 1           60 61    62 63    64 65    ...                        62 columns further
struct InvertedPairs {
  static constexpr int kColumns = 62;

  int words_per_row = 0, rows = 0;  ///< rows of a slice
  std::uint32_t* words = nullptr;   ///< row after row, slice after slice; written by `step_pass_kernel`

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
