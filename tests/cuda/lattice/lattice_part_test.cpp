// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A part of a lattice says of the voxels that it is held for what the whole says. Needs no device.
#include "cuda/lattice/lattice_part.h"

#include <gtest/gtest.h>

#include <map>

#include "deform/core/border.h"
#include "deform/core/visit_cell.h"
#include "deform/field_check.h"
#include "tests/support/fields.h"
#include "tests/support/run.h"

namespace tetwarp::cuda_detail {
namespace {

using namespace test;

/// Vertices of a lattice or of a part of one, as every backend snaps them.
struct Lattice {
  LatticeFrame frame;
  std::vector<Vertex> vertices;

  /// @param displacement  of the part's first vertex
  Lattice(const LatticeFrame& of, const glm::vec3* displacement) : frame(of) {
    const glm::i64vec3 size = frame.cells + std::int64_t{1};
    vertices.resize(static_cast<std::size_t>(size.x * size.y * size.z));
    for (std::size_t n = 0; n < vertices.size(); ++n) {
      const auto number = static_cast<std::int64_t>(n);
      EXPECT_TRUE(frame.snap_vertex({number % size.x, number / size.x % size.y, number / (size.x * size.y)},
                                    displacement[n], vertices[n]));
    }
  }
  const Vertex& vertex(const glm::i64vec3& at) const {
    return vertices[static_cast<std::size_t>((at.z * (frame.cells.y + 1) + at.y) * (frame.cells.x + 1) + at.x)];
  }
  /// Calls `visit(number of the cell, its parity, the cell)`.
  template <class Visit>
  void for_each_cell(Visit&& visit) const {
    for (std::int64_t z = 0, number = 0; z < frame.cells.z; ++z) {
      for (std::int64_t y = 0; y < frame.cells.y; ++y) {
        for (std::int64_t x = 0; x < frame.cells.x; ++x, ++number) {
          Cell cell;
          for (int c = 0; c < 8; ++c)
            cell.corner[c] = vertex(glm::i64vec3(x, y, z) + glm::i64vec3(c & 1, c >> 1 & 1, c >> 2));
          visit(number, ((x + y + z) & 1) != 0, cell);
        }
      }
    }
  }
};

struct Owner {
  std::int64_t tetrahedron;
  glm::vec3 u;
  bool operator==(const Owner&) const = default;
};

/// All owners of the voxels of a region, in the order of their numbers.
std::map<std::size_t, std::vector<Owner>> owners_of(const Lattice& lattice, const Geometry& grid, const Region& region,
                                                    std::int64_t first_cell) {
  std::map<std::size_t, std::vector<Owner>> owners;
  const Nudge& nudge = lattice.frame.nudge;
  lattice.for_each_cell([&](std::int64_t number, bool odd, const Cell& cell) {
    visit_cell(cell, odd, {region.begin, region.end}, nudge,
               [&](const glm::i64vec3& voxel, const glm::i32vec3& signs, int t, const Tetrahedron& tetrahedron) {
                 owners[offset_of(grid, voxel)].push_back({kTetrahedraPerCell * (first_cell + number) + t,
                                                           interpolate_u(tetrahedron, detail::to_steps(voxel), signs)});
               });
  });
  return owners;
}

std::vector<SliceReach> reach_of(const Lattice& lattice) {
  std::vector<SliceReach> reach(static_cast<std::size_t>(lattice.frame.cells.z + 1));
  const std::size_t slice = lattice.vertices.size() / reach.size();
  for (std::size_t n = 0; n < lattice.vertices.size(); ++n) {
    SliceReach& of = reach[n / slice];
    of.low = std::min(of.low, lattice.vertices[n].deformed.z);
    of.high = std::max(of.high, lattice.vertices[n].deformed.z);
  }
  return reach;
}

FieldCase case_number(std::uint64_t n) {
  Random random(test_seed(), n);
  if (n % 3 == 0) return random_injective_case(random);
  if (n % 3 == 1) return random_folding_case(random);
  const Geometry grid = random.chance(0.5) ? unit_grid({7, 6, 31}) : oblique_grid({6, 7, 29});  // many slices
  Geometry lattice = lattice_over(grid, random.one_of<std::int64_t>({1, 2, 3, 5}));
  if (random.chance(0.5)) {
    lattice.spacing.z = 0.7 * grid.spacing.z;  // not at whole steps, and not over all of the grid
    lattice.origin += 0.3;
  }
  const double amplitude = random.real(0, 3);
  return {grid,
          field_in_voxels(grid, lattice,
                          [&](const glm::dvec3&) {
                            return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
                          }),
          "many slices",
          {}};
}

Region slab_of(const Geometry& grid, std::int64_t begin, std::int64_t end) {
  Region slab = whole(grid);
  slab.begin.z = begin;
  slab.end.z = end;
  return slab;
}

TEST(LatticePart, HasTheOwnersOfTheWholeInEverySlab) {
  SCOPED_TRACE(seed_text(test_seed()));
  std::size_t smaller = 0;
  for (std::uint64_t n = 0; n < test_cases(400); ++n) {
    const FieldCase test = case_number(n);
    SCOPED_TRACE(std::to_string(n) + ": " + test.description);
    const Lattice all(make_lattice_frame(test.output, view(test.field, Outside::background)),
                      test.field.displacement.data());
    const std::vector<SliceReach> reach = reach_of(all);
    const std::int64_t slice = (all.frame.cells.x + 1) * (all.frame.cells.y + 1);
    for (const std::int64_t height : {1, 2, 5}) {
      for (std::int64_t k = 0; k < test.output.size.z; k += height) {
        const Region slab = slab_of(test.output, k, std::min(k + height, test.output.size.z));
        const auto expected = owners_of(all, test.output, slab, 0);
        const Slices cells = cells_reaching(reach, slab.begin.z, slab.end.z);
        if (cells.is_empty()) {
          ASSERT_TRUE(expected.empty());
          continue;
        }
        ASSERT_EQ(cells.begin % 2, 0);
        smaller += cells.end - cells.begin < all.frame.cells.z;
        const Lattice part(part_of(all.frame, cells), test.field.displacement.data() + cells.begin * slice);
        ASSERT_EQ(owners_of(part, test.output, slab, cells.begin * all.frame.cells.x * all.frame.cells.y), expected);
      }
    }
  }
  EXPECT_GT(smaller, 0u) << "every part was the whole";
}

TEST(LatticePart, RestBoxHoldsWhereVoxelsComeFrom) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t n = 0; n < test_cases(300); ++n) {
    const FieldCase test = case_number(n);
    SCOPED_TRACE(std::to_string(n) + ": " + test.description);
    const Lattice all(make_lattice_frame(test.output, view(test.field, Outside::background)),
                      test.field.displacement.data());
    const std::vector<SliceReach> reach = reach_of(all);
    for (std::int64_t k = 0; k < test.output.size.z; ++k) {
      const Slices cells = cells_reaching(reach, k, k + 1);
      const RestBox box = rest_box(all.frame, cells);
      for (const auto& [offset, owners] : owners_of(all, test.output, slab_of(test.output, k, k + 1), 0)) {
        const auto at = static_cast<std::int64_t>(offset);
        const glm::dvec3 voxel(at % test.output.size.x, at / test.output.size.x % test.output.size.y, k);
        for (const Owner& owner : owners) {
          const glm::dvec3 place = voxel + glm::dvec3(owner.u);
          for (int axis = 0; axis < 3; ++axis) {
            ASSERT_GE(place[axis], box.low[axis]);
            ASSERT_LE(place[axis], box.high[axis]);
          }
        }
      }
    }
  }
}

/// The winding number of the deformed border around every voxel of a region.
std::map<std::size_t, int> winding_of(const StepLattice& lattice, const Nudge& nudge, const Geometry& grid,
                                      const Region& region) {
  std::map<std::size_t, int> winding;
  for (int n = 0; n < 12; ++n) {  // axis, end, which triangle of a face
    const int axis = n % 3, next = (axis + 1) % 3, last = (axis + 2) % 3;
    for (int v = 0; v < lattice.cells[last]; ++v) {
      for (int u = 0; u < lattice.cells[next]; ++u) {
        const BorderTriangle t = border_triangle(lattice, axis, n / 3 % 2 == 1, {u, v}, n / 6);
        for (auto z = static_cast<int>(region.begin.z); z < region.end.z; ++z) {
          for (int y = 0; y < grid.size.y; ++y) {
            int first = 0;
            const int sign = cross_border<Wide>(t, nudge, y, z, 0, static_cast<int>(grid.size.x), first);
            for (int x = first; sign != 0 && x < grid.size.x; ++x) winding[offset_of(grid, {x, y, z})] += sign;
          }
        }
      }
    }
  }
  std::erase_if(winding, [](const auto& entry) { return entry.second == 0; });
  return winding;
}

/// A part as a gather reads it; no cells where it cannot.
struct Steps {
  StepLattice lattice;
  std::vector<std::uint64_t> packed;

  Steps(const Lattice& of, const Geometry& output) : lattice(make_step_lattice(of.frame, output)) {
    for (const Vertex& vertex : of.vertices)
      packed.push_back(lattice.packing.pack(lattice.packing.lift() - glm::vec3(vertex.u)));
    lattice.packed = packed.data();
    for (std::size_t n = 0; n < of.vertices.size() && lattice.cells.x != 0; ++n) {
      const auto at = static_cast<int>(n);
      const Vertex vertex = lattice.vertex({at % lattice.row, at % lattice.slice / lattice.row, at / lattice.slice});
      EXPECT_EQ(vertex.deformed, of.vertices[n].deformed);
      EXPECT_EQ(vertex.u, of.vertices[n].u);
    }
  }
};

TEST(LatticePart, ItsBorderWindsAroundTheVoxelsOfASlabLikeThatOfTheWhole) {
  SCOPED_TRACE(seed_text(test_seed()));
  std::size_t smaller = 0;
  for (std::uint64_t n = 0; n < test_cases(200); ++n) {
    const FieldCase test = case_number(n);
    if (test.output.spacing != glm::dvec3(1) || test.field.lattice.origin != test.output.origin) continue;
    SCOPED_TRACE(std::to_string(n) + ": " + test.description);
    const Lattice all(make_lattice_frame(test.output, view(test.field, Outside::background)),
                      test.field.displacement.data());
    const Steps whole_steps(all, test.output);
    ASSERT_NE(whole_steps.lattice.cells.x, 0);
    const std::int64_t slice = (all.frame.cells.x + 1) * (all.frame.cells.y + 1);
    const std::vector<SliceReach> reach = reach_of(all);
    for (std::int64_t k = 0; k < test.output.size.z; k += 2) {
      const Region slab = slab_of(test.output, k, std::min(k + 2, test.output.size.z));
      const Slices cells = cells_reaching(reach, slab.begin.z, slab.end.z);
      if (cells.is_empty()) continue;
      smaller += cells.end - cells.begin < all.frame.cells.z;
      const Lattice part(part_of(all.frame, cells), test.field.displacement.data() + cells.begin * slice);
      const Steps steps(part, test.output);
      ASSERT_NE(steps.lattice.cells.x, 0);
      ASSERT_EQ(winding_of(steps.lattice, all.frame.nudge, test.output, slab),
                winding_of(whole_steps.lattice, all.frame.nudge, test.output, slab));
    }
  }
  EXPECT_GT(smaller, 0u) << "every part was the whole";
}

}  // namespace
}  // namespace tetwarp::cuda_detail
