// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.cuh"

namespace tetwarp::cuda_detail {

/// What the tiles of a box tell.
struct TileCounters {
  unsigned long long covered;
  unsigned left;  ///< tiles that more tetrahedra may reach than there is room for
};

/// The tetrahedra that may reach a tile of a lattice.
struct TileCount {
  unsigned all;     ///< how many; perhaps more than there is room for
  unsigned moving;  ///< 1 if some are not at rest
};

/// The way for coarse lattices with large cells at whole steps. Once a field each tetrahedron gets a record: where its
/// faces cross rows (deform/core/row_lines.h), and its map. Tile by tile, those that may reach a tile mark an interval
/// in each row, and the lowest number wins. Nothing need be known of folds or of the border.
class IntervalRaster {
 public:
  /// Whether this is the faster way, and one that does not take too much memory.
  /// @param is_folded  whether much is, so that others would be slow
  static bool suits(const StepLattice& lattice, const SlabBox& box, bool is_folded);

  /// Finds the voxels of `box`, save for tiles that are left. Waits for the stream.
  template <class Sink>
  TileCounters run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream);
  /// Sets the bits of the voxels of tiles that were left. @param several  of the box of the last run, rows from a word
  /// on
  void mark_left(const LatticeOnDevice& lattice, const SlabBox& box, std::uint32_t* several, cudaStream_t stream);

  /// To be called when the field is another one.
  void forget_field() { has_records_ = false; }

 private:
  /// What is needed for tiles of one depth.
  struct Tiles {
    DeviceBuffer<TileCount> counts;  ///< of each tile, i fastest
    DeviceBuffer<unsigned> lists;    ///< of each tile, the numbers of its tetrahedra
  };
  /// Tiles as their kernels know them, with room for all that these write. @tparam kDepth  kTileK, or half of it
  template <int kDepth>
  auto make_task(const LatticeOnDevice& lattice, const SlabBox& box);
  /// One pass over the tiles of one depth; of those without room at twice the depth, if that was tried.
  template <int kDepth, class Sink>
  TileCounters run_tiles(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream);

  bool has_records_ = false;
  bool tried_deep_ = false;     ///< whether the last run began with tiles of full depth
  DeviceBuffer<int4> records_;  ///< of all tetrahedra (tetrahedron_records.cuh)
  Tiles deep_, flat_;           ///< of full depth, and of half of it
  DeviceBuffer<TileCounters> counters_;
  PinnedBuffer<TileCounters> found_;
};

}  // namespace tetwarp::cuda_detail
