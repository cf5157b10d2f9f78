// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Rows of a tetrahedron scanned with vectors, for every instruction set that the processor has, against exact integers;
// and U of rows, against one voxel after the other.
#include "deform/cpu/rows/row_scan.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "deform/cpu/rows/fixed_row.h"
#include "tests/support/instruction_set.h"
#include "tests/support/random.h"

namespace tetwarp::cpu {
namespace {

using namespace test;

Tetrahedron random_tetrahedron(Random& random, std::int64_t size, std::int64_t step) {
  Tetrahedron t{};
  for (Vertex* v : {&t.a, &t.b, &t.c, &t.d}) {
    for (int axis = 0; axis < 3; ++axis)
      v->deformed[axis] = static_cast<int>(random.integer(-size / 4, size) / step * step);
  }
  return t;
}

TEST(RowScans, SayWhatExactIntegersSayOnEveryInstructionSet) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    Random random(test_seed(), 81);
    int rows = 0, unsure = 0, owned = 0;
    for (int n = 0; n < 3000; ++n) {
      const std::int64_t sizes[] = {8192, 40960, 131072, 200000}, steps[] = {1, 64, 4096};
      const Tetrahedron t = random_tetrahedron(random, random.one_of(sizes), random.one_of(steps));
      const glm::i32vec3 signs(random.chance(0.5) ? 1 : -1, random.chance(0.5) ? 1 : -1, random.chance(0.5) ? 1 : -1);
      const glm::ivec3 size(random.integer(1, 32), random.integer(1, 32), random.integer(1, 32));
      RowFaces faces{};
      if (!make_row_faces(t, glm::ivec3(0), signs, size, faces)) continue;
      const auto y_begin = static_cast<int>(random.integer(0, size.y - 1)),
                 z_begin = static_cast<int>(random.integer(0, size.z - 1));
      RowScan scan;
      scan_rows(faces, y_begin, size.y, z_begin, size.z, size.x, scan);
      std::map<int, std::uint32_t> found;
      std::set<int> open;
      for (int m = 0; m < scan.found; ++m) found[scan.found_rows[m]] = scan.found_bits[m];
      for (int m = 0; m < scan.unsure; ++m) open.insert(scan.unsure_rows[m]);
      ASSERT_EQ(found.size(), scan.found);
      ASSERT_EQ(open.size(), scan.unsure);
      for (int z = z_begin; z < size.z; ++z) {
        for (int y = y_begin; y < size.y; ++y, ++rows) {
          const int row = y + kMostRowTile * z;
          const RowInterval in = exact_row(t, glm::ivec3(0), signs, y, z, size.x);
          const std::uint32_t bits = in.is_empty() ? 0 : (~0u >> (32 - (in.end - in.begin))) << in.begin;
          unsure += open.count(row) != 0;
          owned += bits != 0;
          const std::uint32_t said = found.count(row) != 0 ? found[row] : 0;
          found.erase(row);
          if (open.erase(row) == 0) {
            ASSERT_EQ(said, bits) << hwy::TargetName(target) << ", row " << y << ", " << z;
          }
        }
      }
      ASSERT_TRUE(found.empty() && open.empty()) << "rows that were not wanted";
    }
    EXPECT_GT(owned, rows / 20);
    EXPECT_LT(unsure, rows / 4) << "hardly anything is proved";
  }
}

TEST(RowScans, FixedRowsHaveUOfEveryVoxelOnEveryInstructionSet) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    Random random(test_seed(), 82);
    for (int n = 0; n < 2000; ++n) {
      const glm::ivec3 first(random.integer(-40, 500), random.integer(0, 500), random.integer(0, 500));
      std::vector<CoarseMap> maps;
      std::vector<TileMap> of_tile;
      std::vector<RowRun> runs;
      for (int begin = static_cast<int>(random.integer(0, 5)); begin < 32;) {
        CoarseMap map;
        for (int axis = 0; axis < 3; ++axis) {
          map.origin[axis] = first[axis] + static_cast<int>(random.integer(-20, 50));
          map.at_origin[axis] = random.integer(-(1 << 29), 1 << 29);
          for (glm::i32vec3& slope : map.slope) slope[axis] = static_cast<int>(random.integer(-(1 << 22), 1 << 22));
        }
        maps.push_back(map);
        const int end = std::min(32, begin + static_cast<int>(random.integer(1, 20)));
        runs.push_back({begin, end, nullptr});
        begin = end + static_cast<int>(random.integer(0, 3));
      }
      for (const CoarseMap& map : maps) of_tile.emplace_back(map, first);
      for (std::size_t i = 0; i < runs.size(); ++i) runs[i].map = &of_tile[i];
      const auto y = static_cast<int>(random.integer(0, 31)), z = static_cast<int>(random.integer(0, 31));
      std::int32_t row[3][kMostInRow];
      fill_fixed_row(runs.data(), static_cast<int>(runs.size()), y, z, row);
      for (std::size_t i = 0; i < runs.size(); ++i) {
        for (int x = runs[i].begin; x < runs[i].end; ++x) {
          const glm::i64vec3 u = maps[i].u(first + glm::ivec3(x, y, z));
          for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(row[axis][x], u[axis]) << hwy::TargetName(target);
        }
      }
    }
  }
}

}  // namespace
}  // namespace tetwarp::cpu
