// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "deform/core/lattice_vertex.h"
#include "deform/core/visit_cell.h"
#include "deform/cpu/block_scan.h"
#include "deform/cpu/quick_snap.h"
#include "deform/field_check.h"
#include "deform/resampler.h"

namespace tetwarp::cpu {

/// The snapped vertices of a block of cells, i fastest.
struct LatticeBlock {
  static constexpr glm::ivec3 kMostCells = kMostScanned;
  static constexpr int kMostVertices = (kMostCells.x + 1) * (kMostCells.y + 1) * (kMostCells.z + 1);

  glm::i64vec3 first_cell;
  glm::i32vec3 cells;  ///< cells on each axis
  bool at_rest;        ///< whether u of every vertex is zero
  Vertex vertices[kMostVertices];

  Cell cell(const glm::i32vec3& at) const;
  bool is_odd(const glm::i32vec3& at) const {
    return ((first_cell.x + first_cell.y + first_cell.z + at.x + at.y + at.z) & 1) != 0;
  }
};

/// Calls `visit(tetrahedron)` for each inverted tetrahedron of a block.
template <class Visit>
void for_each_inverted(const LatticeBlock& block, Visit&& visit) {
  for (int z = 0; z < block.cells.z; ++z) {
    for (int y = 0; y < block.cells.y; ++y) {
      for (int x = 0; x < block.cells.x; ++x) {
        const Cell cell = block.cell({x, y, z});
        const bool odd = block.is_odd({x, y, z});
        float jacobians[kTetrahedraPerCell];
        cell_jacobians(cell, odd, jacobians);
        for (int number = 0; number < kTetrahedraPerCell; ++number) {
          if (jacobians[number] < 0) visit(tetrahedron_of(cell, number, odd));
        }
      }
    }
  }
}

/// What a pass over all tetrahedra of a field found.
struct FieldStatistics {
  std::uint64_t inverted = 0, degenerate = 0;
  std::int32_t most_moved = 0;  ///< largest displacement of a vertex on an axis, 2^-12 voxel
  double jacobian_min = std::numeric_limits<double>::infinity();
  double jacobian_max = -std::numeric_limits<double>::infinity();

  void add(const FieldStatistics& other);
  /// Adds the tetrahedra of a block.
  void add_cells(const LatticeBlock& block);
  /// Adds the tetrahedra of a block that was scanned.
  /// @param steps  lattice of the block
  void add_scanned(const BlockScan& block, const StepLattice& steps);
};

/// The vertices of a field, snapped on demand, and boxes by which to find the cells that may reach a part of the
/// output.
///
/// Cells are grouped into blocks of up to 16 x 8 x 8, and blocks into groups of 8 x 8 x 8. Each has the box of its
/// deformed vertices. Nothing of the field is copied: the vertices of a block are snapped each time that it is visited.
class LatticeIndex {
 public:
  using Block = LatticeBlock;

  /// Checks the field and builds the boxes, in parallel in the calling task arena.
  /// @throws InputError for a field that cannot be used
  /// @throws Cancelled
  void build(const Geometry& output, const FieldView& field, const Control& control);

  const FieldView& field() const { return field_; }
  const LatticeFrame& frame() const { return frame_; }
  const FieldStatistics& statistics() const { return statistics_; }
  const glm::i64vec3& cells() const { return frame_.cells; }

  /// Calls `visit(block)` for the number of every block whose box may reach the region.
  template <class Visit>
  void find_blocks(const Region& region, Visit&& visit) const {
    const Region near = blocks_near(region);
    for (std::size_t group = 0; group < group_boxes_.size(); ++group) {
      if (!reaches(group_boxes_[group], region)) continue;
      const glm::i64vec3 first = glm::i64vec3(unravel(group, groups_)) * kGroup;
      const glm::i64vec3 begin = glm::max(first, near.begin), end = glm::min(first + kGroup, near.end);
      for (std::int64_t z = begin.z; z < end.z; ++z) {
        for (std::int64_t y = begin.y; y < end.y; ++y) {
          for (std::int64_t x = begin.x; x < end.x; ++x) {
            const auto block = static_cast<std::size_t>((z * blocks_.y + y) * blocks_.x + x);
            if (reaches(boxes_[block], region)) visit(block);
          }
        }
      }
    }
  }

  void load(std::size_t block, Block& into) const;
  /// A snapped vertex.
  /// @throws InputError for a vertex that is not finite or too far away
  Vertex vertex(const glm::i64vec3& at) const {
    const glm::i64vec3& size = field_.lattice->size;
    return vertex(at, field_.displacement[(at.z * size.y + at.y) * size.x + at.x]);
  }
  /// A vertex of the lattice, snapped where another displacement puts it.
  /// @throws InputError for one that is not finite or too far away
  Vertex vertex(const glm::i64vec3& at, const glm::vec3& displacement) const {
    Vertex vertex;
    const bool done = quick_.is_usable() && quick_.snap(glm::ivec3(at), displacement, vertex);
    if (!done && !frame_.snap_vertex(at, displacement, vertex)) refuse_vertex(at);
    return vertex;
  }
  bool has_inverted(std::size_t block) const { return inverted_[block] != 0; }
  /// Whether no vertex of a block is displaced, and every one lies at the whole step where `steps` has it.
  bool rests(std::size_t block) const { return resting_[block] != 0; }
  /// The lattice if its undeformed vertices lie at whole steps; otherwise a lattice without cells.
  const StepLattice& steps() const { return steps_; }
  /// The field in the form that vector code reads; valid if `steps` has cells.
  const VectorField& vectors() const { return vectors_; }
  /// Grows a box in continuous output index until it holds every undeformed place that tetrahedra of a block can give,
  /// with weights that leave [0, 1] by kWeightSlack.
  void rest_box(std::size_t block, glm::dvec3* low, glm::dvec3* high) const;

 private:
  static constexpr std::int64_t kGroup = 8;

  static bool reaches(const Box& box, const Region& region);
  Region blocks_near(const Region& region) const;
  static glm::i64vec3 unravel(std::size_t number, const glm::i64vec3& size);
  void find_blocks_at_rest(const Control& control);
  bool mostly_zero() const;
  void note_moving(const glm::vec3* row, const glm::i64vec3& vertex);
  void look_at(std::size_t block, Block& scratch, FieldStatistics& statistics);
  bool look_with_vectors(std::size_t block, FieldStatistics& statistics);
  void look_closely(std::size_t block, Block& scratch, FieldStatistics& statistics);
  glm::i64vec3 first_cell(std::size_t block) const { return unravel(block, blocks_) * cells_per_block_; }
  void group_boxes();

  FieldView field_;
  LatticeFrame frame_;
  glm::i64vec3 blocks_{0}, groups_{0};
  glm::i64vec3 cells_per_block_{1};
  std::vector<Box> boxes_, group_boxes_;
  std::vector<std::uint8_t> resting_, inverted_;
  StepLattice steps_;
  QuickSnap quick_;
  VectorField vectors_;
  FieldStatistics statistics_;
};

/// The vertices of a lattice at whole steps, snapped on demand, in the form that `vertices_of` takes.
struct SnappedLattice {
  const LatticeIndex& index;
  glm::ivec3 cells;

  explicit SnappedLattice(const LatticeIndex& of) : index(of), cells(of.steps().cells) {}
  Vertex vertex(const glm::ivec3& at) const { return index.vertex(glm::i64vec3(at)); }
};

}  // namespace tetwarp::cpu
