#include "deform/cpu/lattice_index.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string>

#include "deform/field_check.h"

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

namespace {

/// Six times the signed volumes of the tetrahedra of even and odd cells of a lattice at rest at whole steps.
void rest_volumes(const StepLattice& steps, float (&volumes)[2][kTetrahedraPerCell]) {
  for (int odd = 0; odd < 2; ++odd) {
    for (int number = 0; number < kTetrahedraPerCell; ++number) {
      const TetrahedronCorners t = tetrahedron_corners(number, odd != 0);
      const auto edge = [&](int corner) {
        const auto at = [](int c) { return glm::vec3(c & 1, c >> 1 & 1, c >> 2); };
        return (at(corner) - at(t.d)) * steps.cell;
      };
      volumes[odd][number] = detail::edge_determinant(edge(t.a), edge(t.b), edge(t.c));
    }
  }
}

}  // namespace

void FieldStatistics::add_regular_cells(const LatticeBlock& block, const StepLattice& steps) {
  float rest[2][kTetrahedraPerCell];
  rest_volumes(steps, rest);
  const int row = block.cells.x + 1, slice = row * (block.cells.y + 1), vertices = slice * (block.cells.z + 1);
  glm::vec3 moved[LatticeBlock::kMostVertices * LatticeBlock::kMostVertices * LatticeBlock::kMostVertices];
  for (int n = 0; n < vertices; ++n) moved[n] = glm::vec3(block.vertices[n].deformed - block.vertices[0].deformed);
  struct Offsets {
    int a, b, c, d;
  } corners[2][kTetrahedraPerCell];
  for (int odd = 0; odd < 2; ++odd) {
    for (int number = 0; number < kTetrahedraPerCell; ++number) {
      const TetrahedronCorners t = tetrahedron_corners(number, odd != 0);
      const auto offset = [&](int c) { return (c & 1) + (c >> 1 & 1) * row + (c >> 2) * slice; };
      corners[odd][number] = {offset(t.a), offset(t.b), offset(t.c), offset(t.d)};
    }
  }
  float least = INFINITY, most = -INFINITY;
  for (int z = 0; z < block.cells.z; ++z) {
    for (int y = 0; y < block.cells.y; ++y) {
      const glm::vec3* first = moved + z * slice + y * row;
      for (int x = 0; x < block.cells.x; ++x, ++first) {
        const int odd = block.is_odd({x, y, z});
        for (int number = 0; number < kTetrahedraPerCell; ++number) {
          const Offsets& at = corners[odd][number];
          const glm::vec3 d = first[at.d];
          const float jacobian =
              detail::edge_determinant(first[at.a] - d, first[at.b] - d, first[at.c] - d) / rest[odd][number] + 0.0f;
          inverted += jacobian < 0;
          degenerate += jacobian == 0;
          least = std::min(least, jacobian);
          most = std::max(most, jacobian);
        }
      }
    }
  }
  jacobian_min = std::min(jacobian_min, double{least});
  jacobian_max = std::max(jacobian_max, double{most});
}

void FieldStatistics::add(const FieldStatistics& other) {
  inverted += other.inverted;
  degenerate += other.degenerate;
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

void LatticeIndex::build(const Geometry& output, const FieldView& field, const Control& control) {
  field_ = field;
  frame_ = make_lattice_frame(output, field);
  steps_ = make_step_lattice(frame_, output);
  quick_ = QuickSnap(frame_, steps_);

  const double cell_voxels =
      std::min({glm::length(frame_.output_from_lattice.linear[0]), glm::length(frame_.output_from_lattice.linear[1]),
                glm::length(frame_.output_from_lattice.linear[2])});
  cells_per_block_ =
      std::clamp<std::int64_t>(static_cast<std::int64_t>(Block::kMostCells / cell_voxels), 1, Block::kMostCells);
  blocks_ = (frame_.cells + (cells_per_block_ - 1)) / cells_per_block_;
  groups_ = (blocks_ + (kGroup - 1)) / kGroup;
  resting_.assign(static_cast<std::size_t>(blocks_.x * blocks_.y * blocks_.z), 0);
  boxes_.resize(static_cast<std::size_t>(blocks_.x * blocks_.y * blocks_.z));
  group_boxes_.resize(static_cast<std::size_t>(groups_.x * groups_.y * groups_.z));

  tbb::enumerable_thread_specific<FieldStatistics> statistics;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, boxes_.size(), 64), [&](const auto& range) {
    if (control.stop.stop_requested()) throw Cancelled();
    Block scratch;
    for (std::size_t block = range.begin(); block < range.end(); ++block)
      scan_block(block, scratch, statistics.local());
  });
  statistics_ = {};
  for (const FieldStatistics& part : statistics) statistics_.add(part);
  group_boxes();
}

void LatticeIndex::load(std::size_t block, Block& into) const {
  into.first_cell = unravel(block, blocks_) * cells_per_block_;
  into.cells = glm::i32vec3(glm::min(glm::i64vec3(cells_per_block_), frame_.cells - into.first_cell));
  into.at_rest = true;
  const glm::i64vec3& size = field_.lattice->size;
  Vertex* vertex = into.vertices;
  for (int z = 0; z <= into.cells.z; ++z) {
    for (int y = 0; y <= into.cells.y; ++y) {
      const glm::i64vec3 first = into.first_cell + glm::i64vec3(0, y, z);
      const glm::vec3* displacement = field_.displacement + ((first.z * size.y + first.y) * size.x + first.x);
      for (int x = 0; x <= into.cells.x; ++x, ++vertex, ++displacement) {
        const glm::i64vec3 at = first + glm::i64vec3(x, 0, 0);
        const bool done = quick_.is_usable() && quick_.snap(glm::ivec3(at), *displacement, *vertex);
        if (!done && !frame_.snap_vertex(at, *displacement, *vertex)) refuse_vertex(at);
        into.at_rest = into.at_rest && vertex->u == glm::i32vec3(0);
      }
    }
  }
}

void LatticeIndex::scan_block(std::size_t number, Block& block, FieldStatistics& statistics) {
  load(number, block);
  const Vertex& first = block.vertices[0];
  Box box{first.deformed, first.deformed};
  const int vertices = (block.cells.x + 1) * (block.cells.y + 1) * (block.cells.z + 1);
  for (int n = 1; n < vertices; ++n) box.grow(block.vertices[n].deformed);
  boxes_[number] = box;
  const bool regular = is_regular(block);
  if (block.at_rest) {
    resting_[number] = regular;
    statistics.jacobian_min = std::min(statistics.jacobian_min, 1.0);
    statistics.jacobian_max = std::max(statistics.jacobian_max, 1.0);
  } else if (regular && reach_of(box) < std::int64_t{1} << 23) {  // so that edges are whole numbers in float
    statistics.add_regular_cells(block, steps_);
  } else {
    statistics.add_cells(block);
  }
}

/// Whether the undeformed vertices of a block are snapped to where `steps` has them.
bool LatticeIndex::is_regular(const Block& block) const {
  if (steps_.cells.x == 0) return false;
  const glm::i32vec3 first = glm::i32vec3(steps_.first) + glm::i32vec3(block.first_cell) * glm::i32vec3(steps_.cell),
                     cell(steps_.cell);
  const Vertex* vertex = block.vertices;
  bool regular = true;
  for (int z = 0; z <= block.cells.z; ++z) {
    for (int y = 0; y <= block.cells.y; ++y) {
      for (int x = 0; x <= block.cells.x; ++x, ++vertex)
        regular &= vertex->deformed + vertex->u == first + glm::i32vec3(x, y, z) * cell;
    }
  }
  return regular;
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
  const glm::i64vec3 begin = unravel(block, blocks_) * cells_per_block_;
  const glm::i64vec3 end = glm::min(begin + cells_per_block_, frame_.cells);
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
