// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/core/five_tetrahedra.h"
#include "deform/core/gather.h"
#include "deform/cpu/intervals/tetrahedron_batch.h"
#include "deform/cpu/rows/row_scan.h"
#include "deform/cpu/tiles.h"

namespace tetwarp::cpu {

/// The voxels of some rows that a tetrahedron got.
struct OwnedRows {
  const TetrahedronBatch& batch;
  int n;                      ///< the tetrahedron is the n-th of the batch
  const std::uint16_t* rows;  ///< row y, z of the box has number y + kTile z
  const std::uint32_t* bits;  ///< of each row, a bit for each voxel
  int count;
};

/// What is done with owners when they are found.
class IntervalSink {
 public:
  virtual ~IntervalSink() = default;
  /// A box begins: what was taken of it before, if anything, does not count.
  virtual void begin() = 0;
  /// Of the tetrahedra of a batch, which may own voxels, some are taken next.
  virtual void meet(const TetrahedronBatch& batch) = 0;
  /// A tetrahedron got voxels.
  virtual void take(const OwnedRows& owned) = 0;
};

/// Who owns the voxels of a box: in each row along i, every tetrahedron owns an interval (deform/core/row_interval.h).
/// For lattices with large cells and for meshes; docs/design/cpu.md has the way.
class IntervalTile {
 public:
  /// Begins a box of up to kTile voxels on each axis: nobody owns anything.
  /// @param counts  whether voxels are to be counted out among several owners
  /// @param sink    gets what tetrahedra own, unless null
  void begin(const Region& box, const Nudge& nudge, bool counts, IntervalSink* sink);

  /// Whether tetrahedra between two corners of a box may own voxels here. @param low, high  2^-12 voxel
  bool may_reach(const glm::i32vec3& low, const glm::i32vec3& high) const;
  /// Gives a tetrahedron those of its voxels that have no owner yet. So the lowest number wins where numbers rise from
  /// call to call. What it got is known after `end`.
  /// @param number  of the tetrahedron
  void enter(std::uint64_t number, const Tetrahedron& t);
  /// Does what is left to do with those that were entered.
  void end();
  /// Whether some voxel was wanted by several tetrahedra, of those that were looked at.
  bool is_shared() const { return is_shared_; }

  const Region& box() const { return box_; }
  /// A bit for each voxel of a row that has an owner. @param y, z  the row, counted from the box
  std::uint32_t covered(std::int64_t y, std::int64_t z) const {
    return covered_[static_cast<std::size_t>(z * kTile + y)];
  }
  /// How many tetrahedra own each voxel of the box, i fastest, saturated; if counted.
  const std::vector<std::uint16_t>& counts() const { return counts_; }
  /// The same of a row.
  const std::uint16_t* counts(std::int64_t y, std::int64_t z) const { return counts_.data() + first_count(y, z); }

 private:
  /// The part of the box whose voxels are all nudged alike.
  struct Part {
    IntBox voxels;
    glm::i32vec3 signs;

    IntBox reached(const glm::i32vec3& low, const glm::i32vec3& high) const;
  };

  std::int64_t first_count(std::int64_t y, std::int64_t z) const {
    const glm::i64vec3 size = box_.end - box_.begin;
    return (z * size.y + y) * size.x;
  }
  void enter_batch(const Part& part);
  void enter(const Part& part, int n);
  static std::uint32_t exact_bits(const Tetrahedron& t, const Part& part, int y, int z);
  void count(int row, std::uint32_t bits);

  Region box_;
  std::vector<Part> parts_;
  TetrahedronBatch batch_;                            ///< entered, and not yet looked at
  TileTetrahedron in_tile_[TetrahedronBatch::kMost];  ///< of a part
  RowScan scan_;
  std::uint32_t covered_[kTile * kTile];  ///< of row y, z at y + kTile z
  std::vector<std::uint16_t> counts_;
  bool wants_counts_ = false, is_shared_ = false;
  IntervalSink* sink_ = nullptr;
};

}  // namespace tetwarp::cpu
