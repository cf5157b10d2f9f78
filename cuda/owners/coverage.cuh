// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.cuh"
#include "cuda/runtime/bits.cuh"

namespace tetwarp::cuda_detail {

/// A crossing of a row before a voxel before which the row has such a crossing already. A row has a chain of them.
struct ExtraCrossing {
  int next;  ///< numbered from 1; 0: none, -1: some are missing
  int voxel, sign;
};

/// What a gather counts in a box.
struct GatherCounters {
  unsigned long long covered;
  unsigned long long claimed;  ///< voxels that may have several owners, or whose owner was not found otherwise
  unsigned queued;             ///< voxels that the march left to the queue and the exact walk
  unsigned left;               ///< voxels with one owner that these left to the claims
};

/// Which voxels of a box have exactly one owner, so that any owner found is the one; and which must be claimed.
///
/// The winding number of the deformed border is the number of owners, inverted ones counted as -1. Where no inverted
/// tetrahedron can own a voxel, a voxel of winding number 1 has one owner and one of winding number 0 has none
/// (docs/design/cuda.md, "Gather").
class Coverage {
 public:
  /// Makes room for a box and sets all counters to zero, before `find`. The work is queued on the stream.
  void begin(const SlabBox& box, cudaStream_t stream);
  /// Finds the coverage of a field with whole steps. `GatherCounters::claimed` is then the number of voxels that are
  /// `several`. The work is queued on the stream.
  void find(const LatticeOnDevice& lattice, const SlabBox& box, cudaStream_t stream);

  /// Instead of `begin` and `find`: no voxel is `single`, and none `several`. The work is queued on the stream.
  void forget(const SlabBox& box, cudaStream_t stream);

  /// Voxels with exactly one owner.
  BitRows single() const { return {single_.data(), words_}; }
  /// Voxels that may have several owners, or none; none of them is in `single`. Others may be added.
  std::uint32_t* several() const { return several_.data(); }
  /// Counts `several` again, after some were added.
  void count_several(const SlabBox& box, cudaStream_t stream);
  /// The counters, in device memory.
  GatherCounters* counters() const { return reinterpret_cast<GatherCounters*>(crossings_.data()); }
  /// For each slice of the box, the number of its voxels in `several`.
  unsigned* several_in_slice() const { return in_slice_; }
  int words_per_row() const { return words_; }
  /// As many words as `several` has, which are free by then.
  unsigned* scratch() const { return ins(); }

 private:
  static constexpr std::size_t kCounterWords = sizeof(GatherCounters) / sizeof(std::uint32_t);

  std::uint32_t* ins() const { return crossings_.data() + kCounterWords; }

  int words_ = 0;
  DeviceBuffer<std::uint32_t> crossings_;  ///< `counters`, all with one fill; bits where rows go in and, as many words
                                           ///< later, where they come out; of each row, winding number at its first
                                           ///< voxel and first of its chain; of each slice, `several_in_slice`; the
                                           ///< length of `extra_`
  DeviceBuffer<ExtraCrossing> extra_;
  DeviceBuffer<std::uint32_t> single_, several_;
  unsigned* in_slice_ = nullptr;
};

}  // namespace tetwarp::cuda_detail
