// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <mutex>

#include "tests/support/backends.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Regions);

/// A field with folds, holes and untouched parts, and a source, on a grid of several tiles.
struct Scene {
  Geometry grid = unit_grid({70, 41, 37});
  VertexField field;
  Volume<std::int16_t> source;

  explicit Scene(std::uint64_t seed) {
    Random random(seed, 77);
    const std::int64_t cell = random.one_of<std::int64_t>({1, 2, 3, 4, 7, 16});
    const double amplitude = random.real(0.2, 1.5) * static_cast<double>(cell);
    field = field_in_voxels(grid, lattice_over(grid, cell), [&](const glm::dvec3& x) {
      if (x.x > 50) return glm::dvec3(0);
      return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    source = random_values<std::int16_t>(grid, random, -1000, 2000);
    for (std::int16_t& voxel : source.voxels) {
      if (random.chance(0.02)) voxel = random.one_of<std::int16_t>({-2000, INT16_MIN, INT16_MAX});
    }
  }
};

const Options kOptions{
    .interpolation = Interpolation::cubic, .background = -1024, .padding = PaddingRange{-2000, -2000}};

/// Whether a voxel is in a box, by the meaning of its corners.
bool holds(const Region& region, const glm::i64vec3& voxel) {
  bool inside = true;
  for (int axis = 0; axis < 3; ++axis)
    inside = inside && region.begin[axis] <= voxel[axis] && voxel[axis] < region.end[axis];
  return inside;
}

TEST(RegionBoxes, AreTheSetsOfTheirVoxels) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed, 4);
  const Geometry around = unit_grid({8, 8, 8});
  const auto some_box = [&] {  // one in three or so is empty, and some of these end before they begin
    Region box;
    for (int axis = 0; axis < 3; ++axis) {
      box.begin[axis] = random.integer(0, 7);
      box.end[axis] = std::min<std::int64_t>(8, box.begin[axis] + random.integer(-1, 8));
    }
    return box;
  };
  int empty = 0, within = 0;
  for (int number = 0; number < 2000; ++number) {
    const Region a = some_box(), b = random.chance(0.6) ? intersection(a, some_box()) : some_box(),
                 both = intersection(a, b);
    std::int64_t in_a = 0, outside = 0, differs = 0;
    for_each_voxel(around, [&](const glm::i64vec3& voxel, std::size_t) {
      in_a += holds(a, voxel);
      outside += holds(b, voxel) && !holds(a, voxel);
      differs += holds(both, voxel) != (holds(a, voxel) && holds(b, voxel));
    });
    const testing::Message shown = testing::Message() << to_string(a.begin) << " to " << to_string(a.end) << " and "
                                                      << to_string(b.begin) << " to " << to_string(b.end);
    ASSERT_EQ(voxel_count(a), in_a) << shown;
    ASSERT_EQ(is_empty(a), in_a == 0) << shown;
    ASSERT_EQ(contains(a, b), outside == 0) << shown;
    ASSERT_EQ(differs, 0) << shown;
    empty += is_empty(b);
    within += contains(a, b) && !is_empty(b);
  }
  EXPECT_GT(empty, 200);
  EXPECT_GT(within, 30);
  EXPECT_EQ(whole(around), (Region{{0, 0, 0}, {8, 8, 8}}));
}

TEST_P(Regions, ResultIsIndependentOfThreadCount) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  const Scene scene(seed);
  const auto one = make(scene.grid, 1);
  one->set_field(view(scene.field));
  const auto expected = run(*one, scene.source, kOptions);
  for (const int threads : {2, 3, 8, 0}) {
    SCOPED_TRACE(std::to_string(threads) + " threads");
    const auto resampler = make(scene.grid, threads);
    resampler->set_field(view(scene.field));
    const auto found = run(*resampler, scene.source, kOptions);
    expect_same_outcome(expected, found);
    expect_same_report(expected.report, found.report);
  }
}

/// Cuts a region into boxes at random places until they are small.
void split(const Region& region, Random& random, std::vector<Region>& parts) {
  const int axis = random.axis();
  if (voxel_count(region) < 3000 || region.end[axis] - region.begin[axis] < 2) {
    parts.push_back(region);
    return;
  }
  Region low = region, high = region;
  low.end[axis] = high.begin[axis] = random.integer(region.begin[axis] + 1, region.end[axis] - 1);
  split(low, random, parts);
  split(high, random, parts);
}

TEST_P(Regions, PartsAddUpToTheWholeWhateverTheSplit) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  const Scene scene(seed);
  const auto resampler = make(scene.grid);
  resampler->set_field(view(scene.field));
  const auto expected = run(*resampler, scene.source, kOptions);
  const auto& owners = expected.owners.voxels;
  EXPECT_EQ(expected.report.multiply_owned, static_cast<std::uint64_t>(std::count_if(
                                                owners.begin(), owners.end(), [](int count) { return count > 1; })));
  for (std::uint64_t number = 0; number < 5; ++number) {
    Random random(seed, 1000 + number);
    std::vector<Region> parts;
    split(whole(scene.grid), random, parts);
    Outcome<std::int16_t> found = poisoned_outcome<std::int16_t>(scene.grid);
    for (const Region& part : parts) {
      const Target target{.source = view(scene.source),
                          .output = view(found.output),
                          .interpolation = kOptions.interpolation,
                          .background = kOptions.background,
                          .padding = kOptions.padding};
      found.report += resampler->resample(part, {&target, 1}, maps_of(found));
    }
    SCOPED_TRACE("split into " + std::to_string(parts.size()));
    expect_same_outcome(expected, found);
    expect_same_report(expected.report, found.report);
  }
}

/// The voxels of a part of a volume, alone in memory.
template <class V>
std::vector<V> cut_out(const Volume<V>& volume, const Region& part) {
  std::vector<V> voxels;
  for (std::int64_t k = part.begin.z; k < part.end.z; ++k) {
    for (std::int64_t j = part.begin.y; j < part.end.y; ++j) {
      for (std::int64_t i = part.begin.x; i < part.end.x; ++i) {
        voxels.push_back(volume.voxels[offset_of(volume.geometry, {i, j, k})]);
      }
    }
  }
  return voxels;
}

TEST_P(Regions, PartsAreToldWhenTheyAreDone) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  const Scene scene(seed);
  const auto resampler = make(scene.grid);
  resampler->set_field(view(scene.field));
  Outcome<std::int16_t> expected = poisoned_outcome<std::int16_t>(scene.grid), found = expected;
  for (const Region& region : {whole(scene.grid), Region{{3, 5, 2}, {61, 40, 36}}}) {
    std::vector<SliceRange> expected_slices(37), slices(37);
    const auto target_for = [&](Outcome<std::int16_t>& outcome, std::vector<SliceRange>& sampled) {
      return Target{.source = view(scene.source),
                    .output = view(outcome.output),
                    .interpolation = kOptions.interpolation,
                    .background = kOptions.background,
                    .padding = kOptions.padding,
                    .sampled_slices = sampled};
    };
    const Target full = target_for(expected, expected_slices), target = target_for(found, slices);
    resampler->resample(region, {&full, 1}, maps_of(expected));
    std::mutex mutex;
    std::vector<int> told(37, 0);
    const auto finished = [&](const Region& part) {
      const std::scoped_lock lock(mutex);
      EXPECT_EQ(glm::i64vec2(part.begin), glm::i64vec2(region.begin));
      EXPECT_EQ(glm::i64vec2(part.end), glm::i64vec2(region.end));
      EXPECT_TRUE(contains(region, part));
      EXPECT_EQ(cut_out(found.output, part), cut_out(expected.output, part));
      EXPECT_EQ(cut_out(found.coverage, part), cut_out(expected.coverage, part));
      for (std::int64_t k = part.begin.z; k < part.end.z; ++k) {
        const auto n = static_cast<std::size_t>(k);
        ++told[n];
        EXPECT_EQ(slices[n].first, expected_slices[n].first) << "slice " << k;
        EXPECT_EQ(slices[n].last, expected_slices[n].last) << "slice " << k;
      }
    };
    resampler->resample(region, {&target, 1}, maps_of(found), {}, finished);
    for (std::int64_t k = 0; k < 37; ++k) {
      EXPECT_EQ(told[static_cast<std::size_t>(k)], k >= region.begin.z && k < region.end.z) << "slice " << k;
    }
  }
}

TEST_P(Regions, WhatTheListenerThrowsEndsTheCall) {
  const Scene scene(5);
  const auto resampler = make(scene.grid);
  resampler->set_field(view(scene.field));
  const auto expected = run(*resampler, scene.source, kOptions);
  Outcome<std::int16_t> outcome = poisoned_outcome<std::int16_t>(scene.grid);
  const Target target{.source = view(scene.source), .output = view(outcome.output)};
  const auto fail = [](const Region&) { throw Error("the disk is full"); };
  EXPECT_THROW(resampler->resample(whole(scene.grid), {&target, 1}, {}, {}, fail), Error);
  expect_same_outcome(expected, run(*resampler, scene.source, kOptions));
}

/// Resamples one region with views that hold no more than they must.
template <class V>
std::vector<V> run_tight(Resampler& resampler, const Volume<V>& source, const Region& region, const Options& options) {
  const Region needed = resampler.source_region(source.geometry, region);
  EXPECT_TRUE(contains(whole(source.geometry), needed));
  const std::vector<V> part = cut_out(source, needed);
  std::vector<V> output(static_cast<std::size_t>(voxel_count(region)), V(77));
  const V none{};
  const Target target{
      .source = {&source.geometry, needed, voxel_type_of<V>(), 1,
                 reinterpret_cast<const std::byte*>(part.empty() ? &none : part.data())},
      .output = {&resampler.output(), region, voxel_type_of<V>(), 1, reinterpret_cast<std::byte*>(output.data())},
      .interpolation = options.interpolation,
      .background = options.background,
      .padding = options.padding};
  resampler.resample(region, {&target, 1});
  return output;
}

TEST_P(Regions, SourceRegionIsEnoughAndViewsMayHoldJustThat) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  for (std::uint64_t number = 0; number < 4; ++number) {
    const Scene scene(seed + number);
    Random random(seed, 2000 + number);
    const auto resampler = make(scene.grid);
    resampler->set_field(view(scene.field));
    const auto expected = run(*resampler, scene.source, kOptions);
    for (int part = 0; part < 20; ++part) {
      Region region;
      for (int axis = 0; axis < 3; ++axis) {
        region.begin[axis] = random.integer(0, scene.grid.size[axis] - 1);
        region.end[axis] =
            random.integer(region.begin[axis] + 1, std::min(region.begin[axis] + 20, scene.grid.size[axis]));
      }
      ASSERT_TRUE(same_bits(cut_out(expected.output, region), run_tight(*resampler, scene.source, region, kOptions)));
    }
  }
}

TEST_P(Regions, SourceRegionHoldsWhatIsReadBesideThinTetrahedra) {
  // A lattice of one large cell, pressed to a few hundredths of a voxel and a little oblique, in a larger source: a
  // voxel may lie outside the cell that its nudged point is in, and its map then reaches beyond the rest box.
  const Geometry grid = unit_grid({300, 6, 6});
  Geometry lattice = unit_grid({2, 2, 2});
  lattice.spacing = {200, 5, 5};
  lattice.origin = {50, 0, 0};
  Random random(4);
  const auto source = random_values<std::int16_t>(grid, random, -1000, 1000);
  const auto resampler = make(grid);
  for (int thickness = 40; thickness < 140; thickness += 2) {  // 2^-12 voxel
    const VertexField field = field_in_voxels(grid, lattice, [&](const glm::dvec3& x) {
      return glm::dvec3(100 + (x.y / 5 + (x.x - 50) / 200 * thickness) / 4096 - x.x, 0, 0);
    });
    resampler->set_field(view(field, Outside::background));
    const auto expected = run(*resampler, source, kOptions);
    const Region slab{{100, 0, 0}, {101, 6, 6}};
    ASSERT_TRUE(same_bits(cut_out(expected.output, slab), run_tight(*resampler, source, slab, kOptions)))
        << "thickness " << thickness;
    ASSERT_GT(expected.report.covered, 0u);
  }
}

TEST_P(Regions, AVolumeBeyondTwoToThe31VoxelsIsAddressedRight) {
  const Geometry grid = unit_grid({2048, 2048, 1024});
  const auto resampler = make(grid);
  const Region far{{2020, 2011, 1000}, {2048, 2031, 1024}};
  const auto value_at = [](const glm::i64vec3& v) {
    return static_cast<std::int32_t>((v.x * 7919 + v.y * 104729 + v.z * 1299709) % 1000003);
  };
  for (const glm::i64vec3& shift : {glm::i64vec3(0), glm::i64vec3(5, -3, 2)}) {
    const VertexField field = uniform_field(lattice_over(grid, 16), glm::vec3(shift));
    resampler->set_field(view(field));
    const Region needed = resampler->source_region(grid, far);
    ASSERT_LT(voxel_count(needed), 200 * 200 * 200);
    std::vector<std::int32_t> source, output(static_cast<std::size_t>(voxel_count(far)), -77);
    for (std::int64_t k = needed.begin.z; k < needed.end.z; ++k) {
      for (std::int64_t j = needed.begin.y; j < needed.end.y; ++j) {
        for (std::int64_t i = needed.begin.x; i < needed.end.x; ++i) source.push_back(value_at({i, j, k}));
      }
    }
    const Target target{.source = {&grid, needed, VoxelType::i32, 1, reinterpret_cast<const std::byte*>(source.data())},
                        .output = {&grid, far, VoxelType::i32, 1, reinterpret_cast<std::byte*>(output.data())},
                        .background = -5};
    const Report report = resampler->resample(far, {&target, 1});
    EXPECT_EQ(report.covered + report.uncovered, output.size());
    std::size_t n = 0;
    for (std::int64_t k = far.begin.z; k < far.end.z; ++k) {
      for (std::int64_t j = far.begin.y; j < far.end.y; ++j) {
        for (std::int64_t i = far.begin.x; i < far.end.x; ++i, ++n) {
          const glm::i64vec3 from = glm::i64vec3(i, j, k) - shift;
          ASSERT_EQ(output[n], is_voxel(grid, from) ? value_at(from) : -5);
        }
      }
    }
  }
}

TEST_P(Regions, ProgressRisesFromZeroToOneOneCallAtATime) {
  const Scene scene(1);
  const auto resampler = make(scene.grid);
  resampler->set_field(view(scene.field));
  Volume<std::int16_t> output = poisoned<std::int16_t>(scene.grid);
  const Target target{.source = view(scene.source), .output = view(output)};
  std::vector<double> seen;
  std::atomic<int> inside = 0;
  int overlapping = 0;
  const Control control{.progress = [&](double share) {
    overlapping += inside.fetch_add(1) != 0;
    seen.push_back(share);
    inside.fetch_sub(1);
  }};
  resampler->resample(whole(scene.grid), {&target, 1}, {}, control);
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(overlapping, 0);
  EXPECT_GE(seen.front(), 0);
  EXPECT_EQ(seen.back(), 1);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
}

TEST_P(Regions, AStopRequestCancels) {
  const Scene scene(1);
  const auto resampler = make(scene.grid);
  Volume<std::int16_t> output = poisoned<std::int16_t>(scene.grid);
  const Target target{.source = view(scene.source), .output = view(output)};
  std::stop_source stopped;
  stopped.request_stop();
  EXPECT_THROW(resampler->set_field(view(scene.field), {}, {.stop = stopped.get_token()}), Cancelled);
  resampler->set_field(view(scene.field));
  EXPECT_THROW(resampler->resample(whole(scene.grid), {&target, 1}, {}, {.stop = stopped.get_token()}), Cancelled);
  std::stop_source later;
  const Control midway{.progress = [&](double) { later.request_stop(); }, .stop = later.get_token()};
  EXPECT_THROW(resampler->resample(whole(scene.grid), {&target, 1}, {}, midway), Cancelled);
  // After all that the resampler gives what a new one gives.
  const auto again = make(scene.grid);
  again->set_field(view(scene.field));
  expect_same_outcome(run(*again, scene.source), run(*resampler, scene.source));
}

}  // namespace
}  // namespace tetwarp
