// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.h"

namespace tetwarp::cuda_detail {

/// A crossing where there is one of its kind before the same voxel already: a row has a chain of them.
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

/// Which voxels of a box have exactly one owner, so that any owner found is the one; and which need the slow path.
///
/// The winding number of the deformed border is the number of owners, inverted ones counted as -1. Where no inverted
/// tetrahedron can own a voxel and the number is 1, it has one owner; where it is 0, none (docs/design/cuda.md,
/// "Gather").
class Coverage {
 public:
  /// Room for a box, before `find`, with counters that are zero. Queued on the stream.
  void begin(const SlabBox& box, cudaStream_t stream);
  /// For a field with whole steps; `claimed` is then the number of voxels that are `several`. Queued on the stream.
  void find(const LatticeOnDevice& lattice, const SlabBox& box, cudaStream_t stream);

  /// In place of both: none has an owner as yet, no voxel is `single`, and none `several`. Queued on the stream.
  void forget(const SlabBox& box, cudaStream_t stream);

  /// Voxels with one owner.
  BitRows single() const { return {single_.data(), words_}; }
  /// Voxels that may have several, or none: not in `single`. Others may be added.
  std::uint32_t* several() const { return several_.data(); }
  /// Counts them again, where some were added.
  void count_several(const SlabBox& box, cudaStream_t stream);
  /// On the device.
  GatherCounters* counters() const { return reinterpret_cast<GatherCounters*>(crossings_.data()); }
  /// How many of these each slice of the box has.
  unsigned* several_in_slice() const { return in_slice_; }
  int words_per_row() const { return words_; }
  /// As many words as `several` has, which nobody needs any more.
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
