// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <vector>

#include "cuda/lattice/slab.cuh"
#include "cuda/owners/tile_content.cuh"

namespace tetwarp::cuda_detail {

/// Receives the owners of the voxels of a box, as `OffsetSink` (cuda/owners/gather.cuh) receives places.
struct OwnerSink {
  static constexpr bool kIsWide = false;

  SlabBox box;
  unsigned* owner;         ///< lowest number of an owner of each voxel, or kNoTetrahedron
  std::uint16_t* several;  ///< number of owners of each voxel; null: not counted

  __device__ int address(const glm::ivec3& voxel) const { return static_cast<int>(box.offset(glm::i64vec3(voxel))); }
  __device__ int per_slice() const { return static_cast<int>(box.size.x * box.size.y); }
};

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

/// What a run does with tiles that the field before had alike, and keeps for the next run.
enum class Reuse : std::uint8_t {
  nothing,  ///< all tiles are made, and nothing is kept
  later,    ///< all tiles are made, and kept
  now       ///< the sink has what the run before gave it: only tiles that changed are made, if that run kept them
};

/// As `Reuse`, and what of the values in the sink is seen.
struct TileReuse {
  Reuse reuse = Reuse::nothing;
  const SeenSource* seen = nullptr;  ///< with Reuse::now, tiles in which nothing is seen are left; null: none is
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
  TileCounters run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream,
                   const TileReuse& reuse = {});
  /// Sets the bits of the voxels of tiles that were left. @param several  of the box of the last run, rows from a word
  /// on
  void mark_left(const LatticeOnDevice& lattice, const SlabBox& box, std::uint32_t* several, cudaStream_t stream);

  /// To be called when the field is another one.
  void forget_field() { has_records_ = false; }
  /// To be called where the next run must not reuse what the last one kept.
  void forget_tiles() {
    kept_depth_ = 0;
    made_.reset();
  }
  /// Outside which regions the last run gave the sink nothing; none where it gave it all, or tiles were left.
  const std::optional<std::vector<Region>>& changed() const { return made_; }

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
  TileCounters run_tiles(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream,
                         const TileReuse& reuse);
  /// Whether the last run kept all tiles, of this depth, of such a lattice and box.
  bool has_kept(int depth, const StepLattice& lattice, const SlabBox& box) const;
  void keep(int depth, const StepLattice& lattice, const SlabBox& box, cudaStream_t stream);

  bool has_records_ = false;
  bool tried_deep_ = false;     ///< whether the last run began with tiles of full depth
  DeviceBuffer<int4> records_;  ///< of all tetrahedra (tetrahedron_records.cuh)
  Tiles deep_, flat_;           ///< of full depth, and of half of it
  DeviceBuffer<TileCounters> counters_;
  PinnedBuffer<TileCounters> found_;
  int kept_depth_ = 0;        ///< depth of the tiles that were kept; 0: none
  StepLattice kept_lattice_;  ///< that these are of; its vertices are those of `kept_vertices_`
  SlabBox kept_box_{};
  DeviceBuffer<std::uint64_t> kept_vertices_;
  DeviceBuffer<unsigned> kept_covered_;      ///< voxels that each tile covered
  DeviceBuffer<std::uint8_t> changed_;       ///< whether each tile has changed and is made
  DeviceBuffer<std::uint8_t> stale_;         ///< whether each tile has changed since it was made
  bool has_content_ = false;                 ///< whether `content_` is known since all tiles were made
  DeviceBuffer<ValueHull> cells_, content_;  ///< `KeptTiles`
  PinnedBuffer<std::uint8_t> changed_on_host_;
  std::optional<std::vector<Region>> made_;
};

}  // namespace tetwarp::cuda_detail
