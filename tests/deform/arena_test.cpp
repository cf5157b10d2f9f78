// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/arena.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <fstream>

#include "deform/fields/formula.h"
#include "deform/resampler.h"

namespace tetwarp {
namespace {

std::int64_t resident_pages() {
  std::int64_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident;
}

// The sanitizer keeps what was freed, so that memory grows by its own doing.
#if defined(__SANITIZE_ADDRESS__)
constexpr bool kMemoryIsOurs = false;
#else
constexpr bool kMemoryIsOurs = true;
#endif

TEST(Arena, ResamplersThatComeAndGoLeaveNoMemoryBehind) {
  if (!kMemoryIsOurs) GTEST_SKIP() << "the address sanitizer keeps what was freed";
  const Geometry grid{.size = {8, 8, 8}};
  const Volume<std::int16_t> source{grid, std::vector<std::int16_t>(512, 3)};
  const VertexField field = twist(grid, 0, 1);
  const auto deform = [&](int times) {
    for (int n = 0; n < times; ++n) {
      const auto resampler = make_cpu_resampler(grid, {.threads = 2});
      ASSERT_EQ(resample(*resampler, source, field).voxels, source.voxels);
    }
  };
  deform(500);
  const std::int64_t before = resident_pages();
  deform(3000);
  EXPECT_LT(resident_pages() - before, 1000) << "pages; an arena that is lost each time takes 5000";
}

TEST(Arena, IsLentToOneUserAtATime) {
  cpu::Arena first({.threads = 1}), second({.threads = 1});
  int inner = 0;
  first.execute([&] { second.execute([&] { inner = 1; }); });
  EXPECT_EQ(inner, 1);
  EXPECT_EQ(first.max_concurrency(), 1);
  EXPECT_THROW(cpu::Arena({.threads = -1}), InputError);
}

}  // namespace
}  // namespace tetwarp
