// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The intervals of rows against the definition of ownership, voxel by voxel.
#include "deform/core/row_interval.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <iterator>

#include "deform/core/row_lines.h"
#include "tests/support/random.h"

namespace tetwarp {
namespace {

using test::Random;

/// A tile of voxels that are all nudged alike.
struct Tile {
  glm::ivec3 first, size;
  glm::i32vec3 signs;
};

struct Checked {
  int rows = 0, unsure = 0, owned = 0;
  int by_lines = 0, unsure_by_lines = 0;  ///< rows of the box of a tetrahedron that has lines
  int steep = 0, told_of_steep = 0;       ///< tetrahedra of steep lines, and rows of them that float tells
};

RowFaces faces_of(const Tetrahedron& t, const Tile& tile, bool& has_volume) {
  const glm::i32vec3 d = t.d.deformed;
  RowFaces faces{};
  int put = 0;
  faces.lower = make_row_faces(t.a.deformed - d, t.b.deformed - d, t.c.deformed - d, d - tile.first * kStepsPerVoxel,
                               tile.signs, tile.size, [&](int n, const RowFace& face) {
                                 faces.faces[n] = face;
                                 put |= 1 << n;
                               });
  has_volume = faces.lower != 0;
  EXPECT_EQ(put, has_volume ? 15 : 0);
  return faces;
}

/// The rows that the box of a tetrahedron may reach, by its lines: where they are certain they must be right.
void expect_lines(const Tetrahedron& t, const Tile& tile, Checked& checked) {
  NudgeTurns turns;
  for (int axis = 0; axis < 3; ++axis) turns.first_down[axis] = tile.signs[axis] > 0 ? INT32_MAX : INT32_MIN;
  const Box box = box_of(t);
  const IntBox rows = candidates(turns, box.low, box.high, {tile.first, tile.first + tile.size});
  if (rows.is_empty()) return;
  const glm::i32vec3 d = t.d.deformed;
  const glm::ivec3 middle = (box.low + box.high) >> 13;
  const RowLines of = make_row_lines(t.a.deformed - d, t.b.deformed - d, t.c.deformed - d, d, middle);
  const int lower = std::popcount(static_cast<unsigned>(of.lower)),
            upper = std::popcount(static_cast<unsigned>(of.upper));
  if (lower + upper == 0) return;
  ASSERT_TRUE(lower >= 1 && upper >= 1 && lower + upper <= 4 && (of.lower & of.upper) == 0);
  const RowReach reach{tile.first - middle, rows.begin - tile.first, rows.end - 1 - tile.first, tile.signs};
  RowLine moved[4], lines[4]{};
  std::copy(std::begin(of.lines), std::end(of.lines), moved);
  const int zone = shift_lines(moved, of.level, reach);
  order_lines(moved, of.lower, of.upper, lines);
  const bool is_steep = of.is_steep || zone > detail::kMostZone;
  checked.steep += is_steep;
  const RowFaces faces = steep_faces(lines, lower, upper, reach);
  for (int y = reach.first.y; y <= reach.last.y; ++y) {
    const LinesAlongZ along(lines, lower, upper, is_steep ? 0 : zone, y, tile.size.x);
    const RowsAlongZ carefully(faces, y);
    for (int z = reach.first.z; z <= reach.last.z; ++z) {
      const RowInterval exact = exact_row(t, tile.first, tile.signs, y, z, tile.size.x);
      const auto expect_exact = [&](const RowInterval& found, const char* what) {
        ASSERT_EQ(found.is_empty(), exact.is_empty()) << what << " row " << y << ' ' << z << ", zone " << zone;
        if (exact.is_empty()) return;
        ASSERT_EQ(found.begin, exact.begin) << what << " row " << y << ' ' << z << ", zone " << zone;
        ASSERT_EQ(found.end, exact.end) << what << " row " << y << ' ' << z << ", zone " << zone;
      };
      bool is_certain = false;
      const RowInterval by_bounds = carefully.interval(z, tile.size.x, is_certain);
      if (is_certain) {
        ASSERT_NO_FATAL_FAILURE(expect_exact(by_bounds, "steep"));
      }
      checked.told_of_steep += is_steep && is_certain;
      if (is_steep) continue;
      const LinesAlongZ::Ends ends = along.ends(z);
      ++checked.by_lines;
      checked.unsure_by_lines += !ends.is_certain;
      if (ends.is_certain) {
        ASSERT_NO_FATAL_FAILURE(expect_exact(LinesAlongZ::interval(ends), "certain"));
      } else {
        const LinesAlongZ::Doubt doubt = along.doubt(ends);
        const auto owns = [&](int x) {
          int sides[4];
          return owns_exactly(t, (tile.first + glm::ivec3(x, y, z)) * kStepsPerVoxel, tile.signs, sides);
        };
        const RowInterval found =
            settled(doubt.core, doubt.before && owns(doubt.core.begin - 1), doubt.behind && owns(doubt.core.end));
        ASSERT_NO_FATAL_FAILURE(expect_exact(found, "settled"));
      }
    }
  }
}

/// Every voxel of every row: whether it is in the interval just where the tetrahedron owns it.
void expect_intervals(const Tetrahedron& t, const Tile& tile, Checked& checked) {
  ASSERT_TRUE(has_int64_rows(t));
  ASSERT_NO_FATAL_FAILURE(expect_lines(t, tile, checked));
  bool has_volume = false;
  const RowFaces faces = faces_of(t, tile, has_volume);
  for (int y = 0; y < tile.size.y; ++y) {
    for (int z = 0; z < tile.size.z; ++z) {
      const RowInterval exact = exact_row(t, tile.first, tile.signs, y, z, tile.size.x);
      RowInterval found = exact;
      bool is_certain = has_volume;
      if (has_volume) {
        ASSERT_TRUE(faces.lower >= 1 && faces.lower <= 3);
        found = RowsAlongZ(faces, y).interval(z, tile.size.x, is_certain);
      }
      ++checked.rows;
      checked.unsure += !is_certain;
      for (int x = 0; x < tile.size.x; ++x) {
        int sides[4];
        const glm::ivec3 voxel = tile.first + glm::ivec3(x, y, z);
        const bool owns = owns_exactly(t, voxel * kStepsPerVoxel, tile.signs, sides);
        checked.owned += owns;
        ASSERT_EQ(owns, x >= exact.begin && x < exact.end) << "exact, voxel " << x << ' ' << y << ' ' << z;
        if (is_certain) {
          ASSERT_EQ(owns, x >= found.begin && x < found.end) << "float, voxel " << x << ' ' << y << ' ' << z;
        }
      }
    }
  }
}

glm::i32vec3 random_signs(Random& random) {
  const auto sign = [&] { return random.chance(0.5) ? 1 : -1; };
  return {sign(), sign(), sign()};
}

/// Vertices anywhere near a tile; `unit` in 2^-12 voxel: with whole voxels, halves and so on most rows have ties.
Tetrahedron random_tetrahedron(Random& random, const Tile& tile, int length, int unit) {
  const glm::ivec3 from = (tile.first - length / 3) * (kStepsPerVoxel / unit);
  const auto vertex = [&] {
    const auto along = [&](int axis) {
      return static_cast<std::int32_t>(from[axis] + random.integer(0, std::int64_t{length} * kStepsPerVoxel / unit)) *
             unit;
    };
    return Vertex{{along(0), along(1), along(2)}, {0, 0, 0}};
  };
  return {vertex(), vertex(), vertex(), vertex()};
}

TEST(RowInterval, RandomTetrahedraOfAnySizeAndOrientation) {
  SCOPED_TRACE(test::seed_text(test::test_seed()));
  Checked checked;
  for (std::uint64_t n = 0; n < test::test_cases(3000); ++n) {
    Random random(test::test_seed(), n);
    const Tile tile{{static_cast<int>(random.integer(-100, 600)), static_cast<int>(random.integer(-100, 600)),
                     static_cast<int>(random.integer(-100, 600))},
                    {static_cast<int>(random.integer(1, kMostRowTile)), 8, 16},
                    random_signs(random)};
    const int lengths[] = {2, 8, 16, 30, 62}, units[] = {1, 1, 64, 1024, 2048, 4096};
    const Tetrahedron t = random_tetrahedron(random, tile, random.one_of(lengths), random.one_of(units));
    SCOPED_TRACE("case " + std::to_string(n));
    ASSERT_NO_FATAL_FAILURE(expect_intervals(t, tile, checked));
  }
  EXPECT_GT(checked.owned, 20000);
  EXPECT_LT(checked.unsure, checked.rows / 20);
  EXPECT_GT(checked.by_lines, 20000);
  EXPECT_LT(checked.unsure_by_lines, checked.by_lines / 20);
  EXPECT_GT(checked.steep, 10);
  EXPECT_GT(checked.told_of_steep, 300);
}

/// Faces in the planes of voxels, and flat tetrahedra: only the nudge and the tie rule decide.
TEST(RowInterval, FacesThroughVoxels) {
  SCOPED_TRACE(test::seed_text(test::test_seed()));
  Checked checked;
  for (std::uint64_t n = 0; n < test::test_cases(2000); ++n) {
    Random random(test::test_seed(), 10000 + n);
    const Tile tile{{0, 0, 0}, {32, 8, 16}, random_signs(random)};
    const auto whole = [&] {
      return Vertex{
          kStepsPerVoxel * glm::i32vec3(random.integer(-1, 4) * 8, random.integer(0, 2) * 4, random.integer(0, 4) * 4),
          {0, 0, 0}};
    };
    const Tetrahedron t{whole(), whole(), whole(), whole()};
    SCOPED_TRACE("case " + std::to_string(n));
    ASSERT_NO_FATAL_FAILURE(expect_intervals(t, tile, checked));
  }
  EXPECT_GT(checked.owned, 20000);
}

/// Cells of whole voxels of which one vertex has moved a little, as where tissue begins to move: faces that are steep
/// now stand beside faces through voxels, and lines tell nearly all rows even so.
TEST(RowInterval, FacesThroughVoxelsBesideSteepOnes) {
  SCOPED_TRACE(test::seed_text(test::test_seed()));
  Checked checked;
  for (std::uint64_t n = 0; n < test::test_cases(1000); ++n) {
    Random random(test::test_seed(), 30000 + n);
    const Tile tile{{8, 0, 0}, {32, 8, 16}, random_signs(random)};
    const int cell = 4 << random.integer(0, 2);
    const glm::ivec3 from = tile.first + glm::ivec3(random.integer(0, 31), random.integer(0, 7), random.integer(0, 15));
    Cell corners;
    for (int c = 0; c < 8; ++c)
      corners.corner[c] = {kStepsPerVoxel * (from + (cell * glm::ivec3(c & 1, c >> 1 & 1, c >> 2) - cell / 2)), {}};
    const auto little = [&] { return static_cast<std::int32_t>(random.integer(-200, 200)); };
    corners.corner[random.integer(0, 7)].deformed += glm::i32vec3(little(), little(), little());
    SCOPED_TRACE("case " + std::to_string(n));
    for (int number = 0; number < kTetrahedraPerCell; ++number)
      ASSERT_NO_FATAL_FAILURE(expect_intervals(tetrahedron_of(corners, number, n % 2 == 0), tile, checked));
  }
  EXPECT_GT(checked.by_lines, 50000);
  EXPECT_LT(checked.unsure_by_lines, checked.by_lines / 30);
}

/// A vertex that lies so beside a voxel that a face passes through its nudged centre, or just not.
TEST(RowInterval, FacesThroughNudgedVoxels) {
  SCOPED_TRACE(test::seed_text(test::test_seed()));
  Checked checked;
  for (std::uint64_t n = 0; n < test::test_cases(2000); ++n) {
    Random random(test::test_seed(), 20000 + n);
    const Tile tile{{64, 32, 16}, {32, 8, 16}, random_signs(random)};
    // The plane through c that is spanned by two vectors whose cross product is at right angles to d and (1, 0, 0).
    const glm::i32vec3 centre = kStepsPerVoxel * (tile.first + glm::ivec3(9, 3, 7));
    const int scale = static_cast<int>(random.integer(1, 500)), slip = static_cast<int>(random.integer(-1, 1));
    const glm::i32vec3 along(15 * scale * tile.signs.x, 7 * scale * tile.signs.y, 4 * scale * tile.signs.z);
    const Vertex a{centre + along, {0, 0, 0}}, b{centre - along, {0, 0, 0}};
    const Vertex c{centre + glm::i32vec3(random.integer(-9000, 9000), random.integer(-9000, 9000), 9000 + slip), {}};
    const Vertex d{centre + glm::i32vec3(random.integer(-9000, 9000), 9000, random.integer(-9000, 9000)), {}};
    SCOPED_TRACE("case " + std::to_string(n));
    ASSERT_NO_FATAL_FAILURE(expect_intervals({a, b, c, d}, tile, checked));
  }
  EXPECT_GT(checked.unsure, 100);  // exact ties are left to integers
}

/// Five tetrahedra of an undeformed cell of any size share out the voxels around it: none twice, none left.
TEST(RowInterval, CellsHaveNoGaps) {
  for (const int cell : {4, 8, 16, 33, 62}) {
    for (const bool odd : {false, true}) {
      Cell corners;
      for (int c = 0; c < 8; ++c)
        corners.corner[c] = {kStepsPerVoxel * cell * glm::i32vec3(c & 1, c >> 1 & 1, c >> 2), {0, 0, 0}};
      const Tile tile{{0, 0, 0}, {std::min(cell, kMostRowTile), 8, 16}, {1, 1, 1}};
      for (int y = 0; y < std::min(cell, tile.size.y); ++y) {
        for (int z = 0; z < std::min(cell, tile.size.z); ++z) {
          int owned = 0;
          for (int number = 0; number < kTetrahedraPerCell; ++number) {
            const RowInterval in =
                exact_row(tetrahedron_of(corners, number, odd), tile.first, tile.signs, y, z, tile.size.x);
            owned += std::max(in.end - in.begin, 0);
          }
          ASSERT_EQ(owned, tile.size.x) << "cell " << cell << ", row " << y << ' ' << z;
        }
      }
    }
  }
}

}  // namespace
}  // namespace tetwarp
