// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Blocks of cells looked at with vectors, for every instruction set that the processor has, against one tetrahedron
// after the other.
#include "deform/cpu/block_scan.h"

#include <gtest/gtest.h>

#include "deform/core/barycentric.h"
#include "deform/cpu/lattice_index.h"
#include "deform/field_check.h"
#include "tests/support/fields.h"
#include "tests/support/instruction_set.h"

namespace tetwarp::cpu {
namespace {

using namespace test;

/// What a scan of a block should find, computed vertex by vertex.
struct Expected {
  Box box{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  bool at_rest = true;
  std::int32_t most_moved = 0;
  std::uint64_t inverted = 0, degenerate = 0;
  float least = INFINITY, most = -INFINITY;  ///< Jacobian determinant

  Expected(const LatticeFrame& frame, const VertexField& field, const glm::ivec3& first, const glm::ivec3& cells) {
    const glm::i64vec3& size = field.lattice.size;
    const auto vertex = [&](const glm::i64vec3& at) {
      Vertex snapped;
      EXPECT_TRUE(frame.snap_vertex(
          at, field.displacement[static_cast<std::size_t>((at.z * size.y + at.y) * size.x + at.x)], snapped));
      return snapped;
    };
    for (int n = 0; n < cells.x * cells.y * cells.z; ++n) {
      const glm::i64vec3 at(first + glm::ivec3(n % cells.x, n / cells.x % cells.y, n / (cells.x * cells.y)));
      Cell cell;
      for (int c = 0; c < 8; ++c) {
        cell.corner[c] = vertex(at + glm::i64vec3(c & 1, c >> 1 & 1, c >> 2));
        box.grow(cell.corner[c].deformed);
        const glm::i32vec3& u = cell.corner[c].u;
        at_rest = at_rest && u == glm::i32vec3(0);
        most_moved = std::max({most_moved, std::abs(u.x), std::abs(u.y), std::abs(u.z)});
      }
      float jacobians[kTetrahedraPerCell];
      cell_jacobians(cell, ((at.x + at.y + at.z) & 1) != 0, jacobians);
      for (const float jacobian : jacobians) {
        inverted += jacobian < 0;
        degenerate += jacobian == 0;
        least = std::min(least, jacobian);
        most = std::max(most, jacobian);
      }
    }
  }
};

/// @return whether vectors could say anything
bool compare(const Geometry& output, const VertexField& field, const glm::ivec3& first, const glm::ivec3& cells) {
  const LatticeFrame frame = make_lattice_frame(output, view(field, Outside::background));
  const StepLattice steps = make_step_lattice(frame, output);
  BlockScan found;
  if (steps.cells.x == 0 || !scan_block({field.displacement.data(), frame, steps}, first, cells, found)) return false;
  const Expected expected(frame, field, first, cells);
  EXPECT_EQ(found.box.low, expected.box.low);
  EXPECT_EQ(found.box.high, expected.box.high);
  EXPECT_EQ(found.at_rest, expected.at_rest);
  EXPECT_EQ(found.most_moved, expected.most_moved);
  EXPECT_EQ(found.inverted, expected.inverted);
  EXPECT_EQ(expected.degenerate, 0u);
  FieldStatistics statistics;
  statistics.add_scanned(found, steps);
  EXPECT_EQ(statistics.jacobian_min, expected.least);
  EXPECT_EQ(statistics.jacobian_max, expected.most);
  return true;
}

TEST(Blocks, GiveWhatTheirTetrahedraGiveOneByOneOnEveryInstructionSet) {
  SCOPED_TRACE(seed_text(test_seed()));
  int asked = 0, said = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    for (std::uint64_t n = 0; n < 200; ++n) {
      Random random(test_seed(), 700 + n);
      SCOPED_TRACE(n);
      Geometry output = random.chance(0.2) ? oblique_grid({60, 20, 18}) : unit_grid({60, 20, 18});
      if (random.chance(0.4)) output.spacing = {random.real(0.3, 2), random.real(0.3, 2), random.real(0.3, 2)};
      Geometry lattice = lattice_over(output, random.integer(1, 3));
      if (random.chance(0.3)) {  // cells of whole steps, but not of whole voxels
        for (int axis = 0; axis < 3; ++axis)
          lattice.spacing[axis] = output.spacing[axis] * static_cast<double>(random.integer(4000, 9000)) / 4096;
      }
      const double shake = random.one_of<double>({0, 1e-5, 0.01, 0.3, 1, 20}), shift = random.real(-3, 3),
                   moving = random.one_of<double>({1, 1, 0.01});
      const VertexField field = field_in_voxels(output, lattice, [&](const glm::dvec3&) {
        if (!random.chance(moving)) return glm::dvec3(0);
        return glm::dvec3(shift + random.real(-shake, shake), random.real(-shake, shake), random.real(-shake, shake));
      });
      glm::ivec3 first(0), cells(0);
      for (int axis = 0; axis < 3; ++axis) {
        const auto last = static_cast<int>(lattice.size[axis]) - 1;
        first[axis] = static_cast<int>(random.integer(0, last - 1));
        cells[axis] = static_cast<int>(random.integer(1, std::min(last - first[axis], kMostScanned[axis])));
      }
      ++asked;
      said += compare(output, field, first, cells);
    }
  }
  EXPECT_GT(10 * said, 9 * asked);
}

TEST(Blocks, HaveBoxesThatAreExactBeyondWhatFloatHolds) {
  const Geometry output = unit_grid({20, 10, 9});
  Geometry lattice = unit_grid({4, 4, 5});
  lattice.spacing = glm::dvec3(1000);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    const glm::ivec3 first(0), cells(3, 3, 4);
    EXPECT_TRUE(compare(output, uniform_field(lattice, glm::vec3(90 + 1 / 4096.0f)), first, cells));
    compare(output, uniform_field(lattice, glm::vec3(900 + 1 / 4096.0f)), first, cells);
  }
}

TEST(Blocks, LeaveWhatIsNoNumberFlatOrFarToOthers) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    for (const double spacing : {1.0, 0.7}) {
      Geometry output = unit_grid({20, 10, 9});
      output.spacing = glm::dvec3(spacing);
      const glm::ivec3 cells(16, 8, 8);
      for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f,
                              static_cast<float>(1100 * spacing)}) {
        VertexField field = uniform_field(lattice_over(output, 1), glm::vec3(0.25f));
        EXPECT_TRUE(compare(output, field, glm::ivec3(0), cells));
        for (const std::size_t vertex : {0, 5, 16, 20 * 10 * 8 + 20 * 8 + 16}) {
          for (int axis = 0; axis < 3; ++axis) {
            VertexField spoilt = field;
            spoilt.displacement[vertex][axis] = bad;
            EXPECT_FALSE(compare(output, spoilt, glm::ivec3(0), cells)) << vertex << ", " << axis;
          }
        }
      }
      const VertexField flat = field_in_voxels(output, lattice_over(output, 1), [](const glm::dvec3& rest) {
        return glm::dvec3(0, 0, rest.x > 3 && rest.x < 6 ? -rest.z : 0);
      });
      EXPECT_FALSE(compare(output, flat, glm::ivec3(0), cells));
    }
  }
}

}  // namespace
}  // namespace tetwarp::cpu
