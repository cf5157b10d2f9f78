// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "deform/core/five_tetrahedra.h"
#include "deform/core/gather.h"
#include "deform/cpu/rows/row_scan.h"
#include "deform/cpu/tiles.h"

namespace tetwarp::cpu {

/// Who owns the voxels of a box: in each row along i, every tetrahedron owns an interval (deform/core/row_interval.h).
/// For lattices with large cells and for meshes; docs/design/cpu.md has the way.
///
///     voxel     0                   8                   16                        31
///     covered   1 1 1 1 1 1 1 1     1 1 1 . . . . .     . 1 1 1 ...                1     has an owner
///     starts    1 . . . . 1 . .     . . . . . . . .     . 1 . . ...                .     an interval starts here
///     owner     a         b                               c                              whose it is
///
/// The owner of a covered voxel stands where the last interval starts that does not start behind it.
class IntervalTile {
 public:
  /// Begins a box of up to kTile voxels on each axis: nobody owns anything.
  /// @param counts  whether voxels are to be counted out among several owners
  void begin(const Region& box, const Nudge& nudge, bool counts);

  /// Whether tetrahedra between two corners of a box may own voxels here. @param low, high  2^-12 voxel
  bool may_reach(const glm::i32vec3& low, const glm::i32vec3& high) const;
  /// Gives a tetrahedron those of its voxels that have no owner yet. So the lowest number wins where numbers rise from
  /// call to call.
  /// @param number  of the tetrahedron; where there are more than 32 bits hold, nobody asks for `numbers`
  /// @return whether some of its voxels had an owner already
  bool enter(std::uint64_t number, const Tetrahedron& t);

  const Region& box() const { return box_; }
  /// The tetrahedra that own voxels.
  const std::vector<Tetrahedron>& owners() const { return owners_; }
  /// Their numbers.
  const std::vector<std::uint32_t>& numbers() const { return numbers_; }
  /// A bit for each voxel of a row that has an owner. @param y, z  the row, counted from the box
  std::uint32_t covered(std::int64_t y, std::int64_t z) const { return covered_[number(y, z)]; }
  /// Calls `visit(begin, end, index in owners())` for all intervals of a row, from left to right.
  template <class Visit>
  void for_each_interval(std::int64_t y, std::int64_t z, Visit&& visit) const {
    const std::size_t row = number(y, z);
    const std::uint32_t ends = starts_[row] | ~covered_[row];
    for (std::uint32_t left = covered_[row]; left != 0;) {
      const int begin = std::countr_zero(left);
      const std::uint32_t behind = begin == 31 ? 0 : ends & (~0u << (begin + 1));
      const int end = behind == 0 ? 32 : std::countr_zero(behind);
      visit(begin, end, owner_[row][begin]);
      left = end == 32 ? 0 : left & (~0u << end);
    }
  }
  /// How many tetrahedra own each voxel of the box, i fastest, saturated; if counted.
  const std::vector<std::uint16_t>& counts() const { return counts_; }

 private:
  /// The part of the box whose voxels are all nudged alike.
  struct Part {
    IntBox voxels;
    glm::i32vec3 signs;

    IntBox reached(const glm::i32vec3& low, const glm::i32vec3& high) const;
  };

  static std::size_t number(std::int64_t y, std::int64_t z) { return static_cast<std::size_t>(z * kTile + y); }
  bool enter(const Part& part, std::uint64_t number, const Tetrahedron& t);
  static std::uint32_t exact_bits(const Tetrahedron& t, const Part& part, int y, int z);
  /// A tetrahedron that is entered: where the part begins in the box, and the tetrahedron's index in `owners_`.
  struct Entry {
    int column, row;
    std::uint16_t owner;
  };
  void mark(const Entry& entry, int row, std::uint32_t bits, std::uint32_t& any, std::uint32_t& shared);
  void count(std::size_t row, std::uint32_t bits);

  Region box_;
  std::vector<Part> parts_;
  RowFaces faces_;
  RowScan scan_;
  // Of each row, by `number`.
  std::uint32_t starts_[kTile * kTile], covered_[kTile * kTile];
  std::uint16_t owner_[kTile * kTile][kTile];
  std::vector<Tetrahedron> owners_;
  std::vector<std::uint32_t> numbers_;
  std::vector<std::uint16_t> counts_;
  bool wants_counts_ = false;
};

}  // namespace tetwarp::cpu
