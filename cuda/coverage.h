#pragma once

#include "cuda/slab.h"

namespace tetwarp::cuda_detail {

/// Which voxels of a box have exactly one owner, so that any owner found is the one; and which need the slow path.
///
/// The winding number of the deformed border is the number of owners, inverted ones counted as -1. Where no inverted
/// tetrahedron owns a voxel and the number is 1, it has one owner; where it is 0, none (docs/algorithm.md, "Gather").
class Coverage {
 public:
  /// For a field with whole steps. Queued on the stream.
  void find(const DeviceField& field, const BitRows& inverted_cells, bool any_inverted, const SlabBox& box,
            cudaStream_t stream);

  /// Voxels with one owner.
  BitRows single() const { return {single_.data(), words_}; }
  /// Voxels that may have several: not in `single`. Others may be added.
  std::uint32_t* several() const { return several_.data(); }
  int words_per_row() const { return words_; }

 private:
  int words_ = 0;
  DeviceBuffer<std::uint32_t> ins_, outs_;  ///< where rows go in and come out
  DeviceBuffer<int> start_;                 ///< of each row: winding number at its first voxel
  DeviceBuffer<int> collided_;              ///< of each row: not 0 where two crossings of one kind lie before one voxel
  DeviceBuffer<std::uint32_t> single_, several_;
};

}  // namespace tetwarp::cuda_detail
