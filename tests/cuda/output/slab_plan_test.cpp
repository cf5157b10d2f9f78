// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// How an output and a field are split where not everything fits, and how boxes go to the host. Needs no device.
#include "cuda/output/slab_plan.h"

#include <gtest/gtest.h>

#include "cuda/runtime/host_rows.h"
#include "deform/errors.h"
#include "tests/support/random.h"
#include "tests/support/run.h"

namespace tetwarp::cuda_detail {
namespace {

using namespace test;

/// What a slab needs: one slice before and after it of the field and of the source, and 10 bytes a voxel for results.
SlabNeeds needs_of(std::int64_t begin, std::int64_t end) {
  const auto slices = static_cast<std::uint64_t>(end - begin);
  return {100 * (slices + 2), 50 * (slices + 2), 10 * slices};
}

TEST(SlabPlan, TakesTheHighestSlabsThatFit) {
  const auto slices = [](std::uint64_t allowed) { return plan_slabs(5, 105, allowed, needs_of).slices; };
  const std::uint64_t whole = needs_of(5, 105).total(), half = needs_of(0, 50).total(), one = needs_of(0, 1).total();
  EXPECT_EQ(slices(whole), 100);
  EXPECT_EQ(slices(whole - 1), 50);
  EXPECT_EQ(slices(half), 50);
  EXPECT_EQ(slices(half - 1), 25);
  EXPECT_EQ(slices(one), 1);
  EXPECT_EQ(slices(one - 1), 0);
  EXPECT_EQ(slices(0), 0);
}

TEST(SlabPlan, BuffersThatHoldEverySlabFitTogether) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t n = 0; n < 500; ++n) {
    Random random(test_seed(), n);
    const std::int64_t begin = random.integer(0, 9), end = begin + random.integer(1, 40);
    std::vector<SlabNeeds> of_slice(static_cast<std::size_t>(end));
    for (SlabNeeds& needs : of_slice) {
      needs = {static_cast<std::uint64_t>(random.integer(0, 100)), static_cast<std::uint64_t>(random.integer(0, 100)),
               static_cast<std::uint64_t>(random.integer(0, 9))};
    }
    const auto sum = [&](std::int64_t from, std::int64_t to) {
      SlabNeeds all;
      for (std::int64_t k = from; k < to; ++k) {
        const SlabNeeds& needs = of_slice[static_cast<std::size_t>(k)];
        all = {all.field + needs.field, all.source + needs.source, all.output + needs.output};
      }
      return all;
    };
    const auto allowed = static_cast<std::uint64_t>(random.integer(0, 4000));
    const SlabPlan plan = plan_slabs(begin, end, allowed, sum);
    if (plan.slices == 0) {
      EXPECT_GT(plan.needs.total(), allowed);
      continue;
    }
    EXPECT_LE(plan.needs.total(), allowed);
    for (std::int64_t k = begin; k < end; k += plan.slices) {
      const SlabNeeds needs = sum(k, std::min(k + plan.slices, end));
      EXPECT_LE(needs.field, plan.needs.field);
      EXPECT_LE(needs.source, plan.needs.source);
      EXPECT_LE(needs.output, plan.needs.output);
    }
  }
}

TEST(SlabPlan, ARefusalNamesWhatIsNeededAndWhatIsAllowed) {
  try {
    refuse_slab({3'000'000, 2'000'000, 1'500'000}, "whole field", 4'000'000);
    FAIL() << "no refusal";
  } catch (const DeviceError& error) {
    const std::string text = error.what();
    for (const char* part : {"6.500 MB", "whole field 3.000 MB", "sources 2.000 MB", "4.000 MB are allowed"})
      EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST(SlabPlan, PiecesOfAFieldBeginAtEvenSlicesAndFit) {
  for (std::int64_t cells = 1; cells < 12; ++cells) {
    for (std::uint64_t allowed = 0; allowed < 2000; allowed += 10) {
      const std::uint64_t least = static_cast<std::uint64_t>(std::min<std::int64_t>(cells, 2) + 1) * 100;
      if (least > allowed) {
        EXPECT_THROW(cells_of_piece(cells, 100, 0, allowed), DeviceError);
        continue;
      }
      for (const std::uint64_t held : {0, 100, 350, 1000, 3000}) {
        const std::int64_t piece = cells_of_piece(cells, 100, held, allowed);
        ASSERT_GE(piece, 1);
        ASSERT_LE(piece, cells);
        EXPECT_TRUE(piece == cells || piece % 2 == 0) << piece;
        EXPECT_LE(static_cast<std::uint64_t>(piece + 1) * 100, allowed);
      }
    }
  }
  EXPECT_EQ(cells_of_piece(100, 100, 0, 4000), 8);      // a quarter of what is allowed
  EXPECT_EQ(cells_of_piece(100, 100, 2150, 4000), 20);  // or what is held already
  EXPECT_EQ(cells_of_piece(15, 100, 2150, 4000), 15);
}

TEST(HostRows, GoWhereTheBoxLiesInTheView) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t n = 0; n < 300; ++n) {
    Random random(test_seed(), 1000 + n);
    Geometry grid;
    grid.size = {random.integer(1, 9), random.integer(1, 9), random.integer(1, 9)};
    Region held = whole(grid), box = held;
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t size = grid.size[axis];
      held.begin[axis] = random.chance(0.5) ? 0 : random.integer(0, size - 1);
      held.end[axis] = random.chance(0.5) ? size : random.integer(held.begin[axis] + 1, size);
      box.begin[axis] = random.chance(0.5) ? held.begin[axis] : random.integer(held.begin[axis], held.end[axis] - 1);
      box.end[axis] = random.chance(0.5) ? held.end[axis] : random.integer(box.begin[axis] + 1, held.end[axis]);
    }
    std::vector<std::int16_t> line(static_cast<std::size_t>(voxel_count(box)));
    for (std::size_t i = 0; i < line.size(); ++i) line[i] = static_cast<std::int16_t>(i + 1);
    std::vector<std::int16_t> found(static_cast<std::size_t>(voxel_count(held))), expected = found;
    const glm::i64vec3 size = held.end - held.begin;
    std::size_t next = 0;
    for (std::int64_t k = box.begin.z; k < box.end.z; ++k) {
      for (std::int64_t j = box.begin.y; j < box.end.y; ++j) {
        for (std::int64_t i = box.begin.x; i < box.end.x; ++i) {
          const glm::i64vec3 at = glm::i64vec3(i, j, k) - held.begin;
          expected[static_cast<std::size_t>((at.z * size.y + at.y) * size.x + at.x)] = line[next++];
        }
      }
    }
    const VolumeView view{&grid, held, VoxelType::i16, 1, std::as_writable_bytes(std::span(found)).data()};
    const HostRows rows = rows_of(view, box);
    const auto* bytes = std::as_bytes(std::span(line)).data();
    for (std::size_t begin = 0, most = line.size() * 2; begin < most;) {  // in pieces of any length
      const auto size_bytes = static_cast<std::size_t>(random.integer(1, static_cast<std::int64_t>(most - begin)));
      rows.write(begin, bytes + begin, size_bytes);
      begin += size_bytes;
    }
    ASSERT_EQ(found, expected) << to_string(grid.size);
  }
}

}  // namespace
}  // namespace tetwarp::cuda_detail
