// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/lattice_index.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string>

#include "deform/cpu/first_refusal.h"

namespace tetwarp::cpu {

void FieldStatistics::add_cells(const LatticeBlock& block) {
  for (int z = 0; z < block.cells.z; ++z) {
    for (int y = 0; y < block.cells.y; ++y) {
      for (int x = 0; x < block.cells.x; ++x) {
        float jacobians[kTetrahedraPerCell];
        cell_jacobians(block.cell({x, y, z}), block.is_odd({x, y, z}), jacobians);
        for (const double jacobian : jacobians) {
          inverted += jacobian < 0;
          degenerate += jacobian == 0;
          jacobian_min = std::min(jacobian_min, jacobian);
          jacobian_max = std::max(jacobian_max, jacobian);
        }
      }
    }
  }
}

void FieldStatistics::add_scanned(const BlockScan& block, const StepLattice& steps) {
  inverted += block.inverted;
  most_moved = std::max(most_moved, block.most_moved);
  for (int kind = 0; kind < 2; ++kind) {  // corner tetrahedra and centres
    const float rest = rest_volume(steps, kind);
    jacobian_min = std::min(jacobian_min, double{block.least[kind] / rest});
    jacobian_max = std::max(jacobian_max, double{block.most[kind] / rest});
  }
}

void FieldStatistics::add(const FieldStatistics& other) {
  inverted += other.inverted;
  degenerate += other.degenerate;
  most_moved = std::max(most_moved, other.most_moved);
  jacobian_min = std::min(jacobian_min, other.jacobian_min);
  jacobian_max = std::max(jacobian_max, other.jacobian_max);
}

Cell LatticeBlock::cell(const glm::i32vec3& at) const {
  const int row = cells.x + 1, slice = row * (cells.y + 1);
  const Vertex* first = vertices + at.z * slice + at.y * row + at.x;
  return {{first[0], first[1], first[row], first[row + 1], first[slice], first[slice + 1], first[slice + row],
           first[slice + row + 1]}};
}

glm::i64vec3 LatticeIndex::unravel(std::size_t number, const glm::i64vec3& size) {
  const auto n = static_cast<std::int64_t>(number);
  return {n % size.x, n / size.x % size.y, n / (size.x * size.y)};
}

bool LatticeIndex::reaches(const Box& box, const Region& region) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::int64_t{box.high[axis]} < region.begin[axis] * kStepsPerVoxel ||
        std::int64_t{box.low[axis]} > (region.end[axis] - 1) * kStepsPerVoxel) {
      return false;
    }
  }
  return true;
}

/// The blocks that reach a region, and perhaps some more: those whose cells lie, undeformed, no further from it than
/// vertices move.
Region LatticeIndex::blocks_near(const Region& region) const {
  Region near{glm::i64vec3(0), blocks_};
  for (int axis = 0; axis < 3 && steps_.cells.x != 0; ++axis) {
    const double cell = steps_.cell[axis], first = steps_.first[axis], moved = statistics_.most_moved;
    const auto block_at = [&](double steps) {
      return std::floor((steps - first) / (cell * static_cast<double>(cells_per_block_[axis])));
    };
    const double last = static_cast<double>(blocks_[axis] - 1),
                 from = block_at(static_cast<double>(region.begin[axis] * kStepsPerVoxel) - moved) - 1,
                 to = block_at(static_cast<double>((region.end[axis] - 1) * kStepsPerVoxel) + moved) + 1;
    near.begin[axis] = static_cast<std::int64_t>(std::clamp(from, 0.0, last));
    near.end[axis] = static_cast<std::int64_t>(std::clamp(to, 0.0, last)) + 1;
  }
  return near;
}

void LatticeIndex::build(const Geometry& output, const FieldView& field, const Control& control) {
  field_ = field;
  frame_ = make_lattice_frame(output, field);
  steps_ = make_step_lattice(frame_, output);
  quick_ = QuickSnap(frame_, steps_);
  if (!quick_.rests_at_steps()) steps_ = {};
  if (steps_.cells.x != 0) vectors_ = {field.displacement, frame_, steps_};

  const double cell_voxels =
      std::min({glm::length(frame_.output_from_lattice.linear[0]), glm::length(frame_.output_from_lattice.linear[1]),
                glm::length(frame_.output_from_lattice.linear[2])});
  const glm::dvec3 most(Block::kMostCells);
  cells_per_block_ = glm::i64vec3(glm::clamp(glm::floor(most / cell_voxels), glm::dvec3(1), most));
  blocks_ = (frame_.cells + (cells_per_block_ - std::int64_t{1})) / cells_per_block_;
  groups_ = (blocks_ + (kGroup - 1)) / kGroup;
  resting_.assign(static_cast<std::size_t>(blocks_.x * blocks_.y * blocks_.z), 0);
  inverted_.assign(resting_.size(), 0);
  boxes_.resize(static_cast<std::size_t>(blocks_.x * blocks_.y * blocks_.z));
  group_boxes_.resize(static_cast<std::size_t>(groups_.x * groups_.y * groups_.z));

  if (steps_.cells.x != 0 && mostly_zero()) find_blocks_at_rest(control);
  tbb::enumerable_thread_specific<FieldStatistics> statistics;
  FirstRefusal refusal;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, boxes_.size(), 64), [&](const auto& range) {
    if (control.stop.stop_requested()) throw Cancelled();
    refusal.attempt(static_cast<std::int64_t>(range.begin()), [&] {
      Block scratch;
      for (std::size_t block = range.begin(); block < range.end(); ++block) look_at(block, scratch, statistics.local());
    });
  });
  refusal.rethrow();
  statistics_ = {};
  for (const FieldStatistics& part : statistics) statistics_.add(part);
  group_boxes();
}

void LatticeIndex::load(std::size_t block, Block& into) const {
  into.first_cell = first_cell(block);
  into.cells = glm::i32vec3(glm::min(cells_per_block_, frame_.cells - into.first_cell));
  into.at_rest = true;
  const glm::i64vec3& size = field_.lattice->size;
  Vertex* vertex = into.vertices;
  for (int z = 0; z <= into.cells.z; ++z) {
    for (int y = 0; y <= into.cells.y; ++y) {
      const glm::i64vec3 first = into.first_cell + glm::i64vec3(0, y, z);
      const glm::vec3* displacement = field_.displacement + ((first.z * size.y + first.y) * size.x + first.x);
      for (int x = 0; x <= into.cells.x; ++x, ++vertex, ++displacement) {
        *vertex = this->vertex(first + glm::i64vec3(x, 0, 0), *displacement);
        into.at_rest = into.at_rest && vertex->u == glm::i32vec3(0);
      }
    }
  }
}

void LatticeIndex::look_at(std::size_t number, Block& block, FieldStatistics& statistics) {
  const std::uint64_t inverted = statistics.inverted;
  if (!look_with_vectors(number, statistics)) look_closely(number, block, statistics);
  inverted_[number] = statistics.inverted != inverted;
}

/// Whether most of some vertices that are looked at have no displacement.
bool LatticeIndex::mostly_zero() const {
  constexpr std::int64_t kAsked = 4096;
  const glm::i64vec3& size = field_.lattice->size;
  const std::int64_t vertices = size.x * size.y * size.z, step = vertices / kAsked + 1;
  std::int64_t zero = 0;
  for (std::int64_t n = 0; n < vertices; n += step) zero += field_.displacement[n] == glm::vec3(0);
  return 2 * zero > vertices / step;
}

/// Reads the field from end to end, as fast as memory allows, to find the blocks whose displacements are all zero.
void LatticeIndex::find_blocks_at_rest(const Control& control) {
  const glm::i64vec3& size = field_.lattice->size;
  std::fill(resting_.begin(), resting_.end(), std::uint8_t{1});
  tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, size.y * size.z, 64), [&](const auto& range) {
    if (control.stop.stop_requested()) throw Cancelled();
    for (std::int64_t row = range.begin(); row < range.end(); ++row)
      note_moving(field_.displacement + row * size.x, {0, row % size.y, row / size.y});
  });
}

/// Marks the blocks that a vertex with a displacement belongs to. @param row  a row of vertices  @param vertex  the
/// first of them
void LatticeIndex::note_moving(const glm::vec3* row, const glm::i64vec3& vertex) {
  for (std::int64_t x = 0; x < blocks_.x; ++x) {
    const std::int64_t first = x * cells_per_block_.x, last = std::min(first + cells_per_block_.x, frame_.cells.x);
    const auto* bits = reinterpret_cast<const std::uint32_t*>(row + first);
    std::uint32_t any = 0;
    for (std::int64_t n = 0; n < 3 * (last - first + 1); ++n) any |= bits[n];
    if (any == 0) continue;
    for (int corner = 0; corner < 4; ++corner) {  // blocks that have these vertices on a face
      const glm::i64vec3 at = glm::max((vertex - glm::i64vec3(0, corner & 1, corner >> 1)) / cells_per_block_,
                                       glm::i64vec3(0)),
                         block = glm::min(at, blocks_ - std::int64_t{1});
      std::atomic_ref(resting_[static_cast<std::size_t>((block.z * blocks_.y + block.y) * blocks_.x + x)])
          .store(0, std::memory_order_relaxed);
    }
  }
}

bool LatticeIndex::look_with_vectors(std::size_t number, FieldStatistics& statistics) {
  if (steps_.cells.x == 0) return false;
  BlockScan scan;
  const glm::ivec3 first(first_cell(number)), cells(glm::min(cells_per_block_, frame_.cells - glm::i64vec3(first)));
  if (resting_[number] != 0) {
    scan = block_at_rest(steps_, first, cells);
  } else if (!scan_block(vectors_, first, cells, scan)) {
    return false;
  }
  boxes_[number] = scan.box;
  resting_[number] = scan.at_rest;
  statistics.add_scanned(scan, steps_);
  return true;
}

void LatticeIndex::look_closely(std::size_t number, Block& block, FieldStatistics& statistics) {
  load(number, block);
  const Vertex& first = block.vertices[0];
  Box box{first.deformed, first.deformed};
  const int vertices = (block.cells.x + 1) * (block.cells.y + 1) * (block.cells.z + 1);
  for (int n = 0; n < vertices; ++n) {
    box.grow(block.vertices[n].deformed);
    const glm::i32vec3 u = glm::abs(block.vertices[n].u);
    statistics.most_moved = std::max({statistics.most_moved, u.x, u.y, u.z});
  }
  boxes_[number] = box;
  resting_[number] = block.at_rest && steps_.cells.x != 0;
  if (block.at_rest) {
    statistics.jacobian_min = std::min(statistics.jacobian_min, 1.0);
    statistics.jacobian_max = std::max(statistics.jacobian_max, 1.0);
  } else {
    statistics.add_cells(block);
  }
}

void LatticeIndex::group_boxes() {
  for (std::size_t group = 0; group < group_boxes_.size(); ++group) {
    const glm::i64vec3 begin = unravel(group, groups_) * kGroup;
    const glm::i64vec3 end = glm::min(begin + kGroup, blocks_);
    Box& box = group_boxes_[group];
    box = boxes_[static_cast<std::size_t>((begin.z * blocks_.y + begin.y) * blocks_.x + begin.x)];
    for (std::int64_t z = begin.z; z < end.z; ++z) {
      for (std::int64_t y = begin.y; y < end.y; ++y) {
        for (std::int64_t x = begin.x; x < end.x; ++x) {
          const Box& member = boxes_[static_cast<std::size_t>((z * blocks_.y + y) * blocks_.x + x)];
          box.grow(member.low);
          box.grow(member.high);
        }
      }
    }
  }
}

void LatticeIndex::rest_box(std::size_t block, glm::dvec3* low, glm::dvec3* high) const {
  const glm::i64vec3 begin = first_cell(block), end = glm::min(begin + cells_per_block_, frame_.cells);
  const glm::dvec3 margin = frame_.beyond_rest();
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 vertex(corner & 1 ? end.x : begin.x, corner >> 1 & 1 ? end.y : begin.y,
                            corner >> 2 ? end.z : begin.z);
    const glm::dvec3 at = frame_.output_from_lattice(vertex);
    *low = glm::min(*low, at - margin);
    *high = glm::max(*high, at + margin);
  }
}

}  // namespace tetwarp::cpu
