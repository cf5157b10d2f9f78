// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.cuh"

namespace tetwarp::cuda_detail {

/// How far the vertices of a block of cells are displaced, 2^-12 voxel, both ends included.
struct BlockMoves {
  glm::ivec3 low, high;
};

/// Which cells may own voxels of a tile.
struct TileCells {
  glm::ivec3 first, size;
  glm::ivec3 source_begin, source_end;  ///< where its voxels come from, with room to spare
  int rests;  ///< whether the tile lies within the undeformed lattice, and all that may reach it is at rest
  int left;   ///< whether it is left to the claims
};

/// The way for lattices with large cells at whole steps: tile by tile, the tetrahedra that may reach a tile are
/// rasterised, each row an interval (deform/core/row_interval.h), and the lowest number wins. Nothing need be known
/// of folds or of the border.
class IntervalRaster {
 public:
  struct Counters {
    unsigned long long covered;
    unsigned left;  ///< tiles that more tetrahedra may reach than there is room for
  };

  /// Whether this is the faster way. @param is_folded  whether much is, so that others would be slow
  static bool suits(const StepLattice& lattice, bool is_folded);

  /// Finds the voxels of `box`, save for tiles that are left. Queued on the stream.
  template <class Sink>
  void run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream);
  /// Waits for the stream.
  Counters counters(cudaStream_t stream);
  /// Sets the bits of the voxels of tiles that were left. @param several  of the box of the last run, rows from a word
  /// on
  void mark_left(const LatticeOnDevice& lattice, const SlabBox& box, std::uint32_t* several, cudaStream_t stream) const;

  /// To be called when the field is another one.
  void forget_field() { has_moves_ = false; }

 private:
  bool has_moves_ = false;
  DeviceBuffer<BlockMoves> moves_;  ///< of all cells, and of each block
  DeviceBuffer<TileCells> cells_;   ///< of each tile, i fastest
  DeviceBuffer<Counters> counters_;
  PinnedBuffer<Counters> found_;
};

}  // namespace tetwarp::cuda_detail
