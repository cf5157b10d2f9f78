// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Rows of a tetrahedron scanned with vectors, for every instruction set that the processor has, against exact integers;
// and lists of voxels and their U, against one voxel after the other.
#include "deform/cpu/rows/row_scan.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "deform/cpu/rows/fixed_list.h"
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

TEST(RowScans, ListTheVoxelsOfRowsOnEveryInstructionSet) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    Random random(test_seed(), 83);
    for (int n = 0; n < 500; ++n) {
      const auto count = static_cast<int>(random.integer(1, 40));
      std::vector<std::uint16_t> rows, expected;
      std::vector<std::uint32_t> bits;
      for (int row = 0; row < count; ++row) {
        const std::uint32_t runs[] = {~0u, 1u << 31, 1u, 0x7ffffff0u,
                                      static_cast<std::uint32_t>(random.integer(0, UINT32_MAX))};
        rows.push_back(static_cast<std::uint16_t>(random.integer(0, RowScan::kMost - 1)));
        bits.push_back(random.one_of(runs));
        for (int x = 0; x < kMostRowTile; ++x) {
          if (bits.back() >> x & 1) expected.push_back(static_cast<std::uint16_t>(rows.back() * kMostRowTile + x));
        }
      }
      constexpr int kRoom = 100;
      std::uint16_t numbers[kRoom + 16];
      std::vector<std::uint16_t> found;
      auto before = static_cast<int>(random.integer(0, kRoom - kMostRowTile));
      for (int done = 0; done < count; before = 0) {
        int listed = before;
        const int some = list_voxels(rows.data() + done, bits.data() + done, count - done, numbers, listed, kRoom);
        ASSERT_GT(some, 0);
        ASSERT_LE(listed, kRoom);
        done += some;
        found.insert(found.end(), numbers + before, numbers + listed);
      }
      ASSERT_EQ(found, expected) << hwy::TargetName(target);
    }
  }
}

CoarseMap random_map(Random& random, const glm::ivec3& near) {
  CoarseMap map;
  for (int axis = 0; axis < 3; ++axis) {
    map.origin[axis] = near[axis] + static_cast<int>(random.integer(-20, 50));
    map.at_origin[axis] = random.integer(-(1 << 29), 1 << 29);
    for (glm::i32vec3& slope : map.slope) slope[axis] = static_cast<int>(random.integer(-(1 << 22), 1 << 22));
  }
  return map;
}

TEST(FixedLists, HaveUOfEveryVoxelOnEveryInstructionSet) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    Random random(test_seed(), 82);
    for (int n = 0; n < 500; ++n) {
      const glm::ivec3 first(random.integer(-40, 500), random.integer(0, 500), random.integer(0, 500));
      const CoarseMap map = random_map(random, first);
      const auto count = static_cast<int>(random.integer(1, kMostTogether));
      std::uint16_t numbers[kRoomTogether];
      for (std::uint16_t& number : numbers) number = static_cast<std::uint16_t>(random.integer(0, 32767));
      std::int32_t u[3][kRoomTogether];
      fill_fixed_list(TileMap(map, first), numbers, count, {u[0], u[1], u[2]});
      for (int i = 0; i < count; ++i) {
        const glm::i64vec3 expected = map.u(first + VoxelList::in_tile(numbers[i]));
        for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(u[axis][i], expected[axis]) << hwy::TargetName(target);
      }
    }
  }
}

}  // namespace
}  // namespace tetwarp::cpu
