// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Tetrahedra that are set up with vectors, for every instruction set that the processor has, against one after the
// other and exact integers.
#include "deform/cpu/intervals/tetrahedron_batch.h"

#include <gtest/gtest.h>

#include <vector>

#include "deform/core/ownership.h"
#include "deform/cpu/rows/row_scan.h"
#include "tests/support/instruction_set.h"
#include "tests/support/random.h"

namespace tetwarp::cpu {
namespace {

using namespace test;

/// Corners on whole voxels or not, near a tile or far from it, of all sizes, flat ones too; displacements up to 250
/// voxels.
Tetrahedron random_tetrahedron(Random& random, const glm::ivec3& near) {
  const std::int64_t sizes[] = {4096, 20000, 100000, 250000, 900000}, steps[] = {1, 512, 4096};
  const std::int64_t size = random.one_of(sizes), step = random.one_of(steps), moved = random.one_of(sizes);
  Tetrahedron t{};
  for (Vertex* v : {&t.a, &t.b, &t.c, &t.d}) {
    for (int axis = 0; axis < 3; ++axis) {
      v->deformed[axis] = near[axis] * kStepsPerVoxel + static_cast<int>(random.integer(-size / 4, size) / step * step);
      v->u[axis] = static_cast<int>(random.integer(-moved, moved));
    }
  }
  if (random.chance(0.1)) t.c = t.b;
  if (random.chance(0.1)) t.a.deformed.z = t.b.deformed.z = t.c.deformed.z = t.d.deformed.z;
  return t;
}

struct Batch {
  std::vector<Tetrahedron> tetrahedra;
  TetrahedronBatch batch;

  Batch(Random& random, const glm::ivec3& near) {
    for (std::int64_t n = random.integer(1, TetrahedronBatch::kMost); n > 0; --n) {
      tetrahedra.push_back(random_tetrahedron(random, near));
      batch.add(static_cast<std::uint64_t>(n) << 40, tetrahedra.back());
    }
  }
};

glm::ivec3 random_first(Random& random) {
  const int far = random.chance(0.1) ? 200000 : 500;
  return {random.integer(-40, far), random.integer(0, far), random.integer(0, far)};
}

TEST(TetrahedronBatches, HaveTheMapsOfOneAfterTheOtherOnEveryInstructionSet) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    Random random(test_seed(), 84);
    int thin = 0, usable = 0;
    for (int n = 0; n < 500; ++n) {
      const glm::ivec3 first = random_first(random);
      const Batch of(random, first);
      TileMaps maps;
      find_maps(of.batch, first, maps);
      for (std::size_t i = 0; i < of.tetrahedra.size(); ++i) {
        const CoarseMap expected(of.tetrahedra[i]);
        ASSERT_EQ(maps.is_thin[i], expected.is_thin) << hwy::TargetName(target);
        thin += expected.is_thin;
        if (expected.is_thin) continue;
        ++usable;
        const TileMap over_tile(expected, first);
        ASSERT_EQ(maps.map[i].at, over_tile.at) << hwy::TargetName(target);
        for (int way = 0; way < 3; ++way)
          ASSERT_EQ(maps.map[i].along[way], over_tile.along[way]) << hwy::TargetName(target);
      }
    }
    EXPECT_GT(thin, 300);
    EXPECT_GT(usable, 300);
  }
}

TEST(TetrahedronBatches, CrossRowsWhereExactIntegersSayOnEveryInstructionSet) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    Random random(test_seed(), 85);
    int long_ones = 0, flat = 0, owned = 0, unsure = 0, rows = 0;
    for (int n = 0; n < 60; ++n) {
      const glm::ivec3 first = random_first(random), size(random.integer(1, 32), random.integer(1, 32), 7);
      const glm::i32vec3 signs(random.chance(0.5) ? 1 : -1, random.chance(0.5) ? 1 : -1, random.chance(0.5) ? 1 : -1);
      const Batch of(random, first);
      TileTetrahedron in_tile[TetrahedronBatch::kMost];
      find_in_tile(of.batch, first, signs, size, in_tile);
      for (std::size_t i = 0; i < of.tetrahedra.size(); ++i) {
        const Tetrahedron& t = of.tetrahedra[i];
        ASSERT_EQ(in_tile[i].fits_int64, has_int64_rows(t)) << hwy::TargetName(target);
        long_ones += !in_tile[i].fits_int64;
        // Above and below the nudged voxels of the tile, which begin one step after a corner that they are nudged from.
        const Box around = box_of(t);
        for (int axis = 0; axis < 3; ++axis) {
          int begin = 0, end = size[axis];
          const auto holds = [&](int voxel) {
            const std::int64_t nudged = 16 * std::int64_t{first[axis] + voxel} * kStepsPerVoxel + signs[axis];
            return nudged > 16 * std::int64_t{around.low[axis]} && nudged < 16 * std::int64_t{around.high[axis]};
          };
          while (begin < end && !holds(begin)) ++begin;
          while (begin < end && !holds(end - 1)) --end;
          const int found_begin = in_tile[i].reached.begin[axis], found_end = in_tile[i].reached.end[axis];
          if (begin == end) {
            ASSERT_GE(found_begin, found_end) << hwy::TargetName(target);
          } else {
            ASSERT_EQ(found_begin, begin) << hwy::TargetName(target);
            ASSERT_EQ(found_end, end) << hwy::TargetName(target);
          }
        }
        if (!in_tile[i].fits_int64) continue;
        RowScan scan;
        flat += in_tile[i].faces.lower == 0;
        if (in_tile[i].faces.lower == 0) continue;
        scan_rows(in_tile[i].faces, 0, size.y, 0, size.z, size.x, scan);
        std::vector<std::uint32_t> found(RowScan::kMost);
        std::vector<bool> open(RowScan::kMost);
        for (int m = 0; m < scan.found; ++m) found[scan.found_rows[m]] = scan.found_bits[m];
        for (int m = 0; m < scan.unsure; ++m) open[scan.unsure_rows[m]] = true;
        for (int z = 0; z < size.z; ++z) {
          for (int y = 0; y < size.y; ++y, ++rows) {
            const auto row = static_cast<std::size_t>(y + kMostRowTile * z);
            const RowInterval in = exact_row(t, first, signs, y, z, size.x);
            const std::uint32_t bits = in.is_empty() ? 0 : (~0u >> (32 - (in.end - in.begin))) << in.begin;
            owned += bits != 0;
            unsure += open[row];
            if (!open[row]) {
              ASSERT_EQ(found[row], bits) << hwy::TargetName(target) << ", row " << y << ", " << z;
            }
          }
        }
      }
    }
    EXPECT_GT(long_ones, 20);
    EXPECT_GT(flat, 20);
    EXPECT_GT(owned, rows / 50);
    EXPECT_LT(unsure, rows / 4) << "hardly anything is proved";
  }
}

}  // namespace
}  // namespace tetwarp::cpu
