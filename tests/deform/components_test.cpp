// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Volumes with several values a voxel, against each value as a volume of its own.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/backends.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Components);

constexpr int kCounts[] = {2, 3, 4, 7};

/// Values side by side.
template <class V>
struct Vectors {
  Geometry geometry;
  int components;
  std::vector<V> values;

  Vectors(const Geometry& grid, int count)
      : geometry(grid),
        components(count),
        values(poisoned<V>(grid).voxels.size() * static_cast<std::size_t>(count),
               poisoned<V>(unit_grid({1, 1, 1})).voxels[0]) {}

  /// @param buffered  voxels that are held; `values` may begin with more room than they take
  VolumeView view(const Region& buffered) {
    return {&geometry, buffered, voxel_type_of<V>(), components, std::as_writable_bytes(std::span(values)).data()};
  }
  VolumeView view() { return view(whole(geometry)); }
  ConstVolumeView view() const { return const_cast<Vectors*>(this)->view(); }

  Volume<V> component(int number) const {
    Volume<V> volume{geometry, {}};
    for (std::size_t n = static_cast<std::size_t>(number); n < values.size(); n += static_cast<std::size_t>(components))
      volume.voxels.push_back(values[n]);
    return volume;
  }
};

/// Values that repeat, so that votes have labels to sum.
template <class V>
Vectors<V> random_vectors(const Geometry& grid, int components, Random& random) {
  Vectors<V> vectors(grid, components);
  const double low = std::numeric_limits<V>::is_signed ? -100 : 0;
  for (V& value : vectors.values)
    value = static_cast<V>(std::nearbyint(random.chance(0.5) ? random.real(low, 120) : random.real(1, 3)));
  return vectors;
}

VertexField folding_field(const Geometry& grid, Random& random) {
  const std::int64_t cell = random.one_of<std::int64_t>({1, 2, 3, 8});
  const double amplitude = random.real(0.3, 1.2) * static_cast<double>(cell);
  return field_in_voxels(grid, lattice_over(grid, cell), [&](const glm::dvec3& x) {
    if (x.x > 25) return glm::dvec3(0);
    return amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
}

template <class V>
void expect_components_alone(Resampler& resampler, const Vectors<V>& source, Interpolation interpolation) {
  SCOPED_TRACE(to_string(voxel_type_of<V>()) + " x " + std::to_string(source.components) + ", interpolation " +
               std::to_string(static_cast<int>(interpolation)));
  const Geometry& grid = resampler.output();
  Vectors<V> output(grid, source.components);
  auto maps = poisoned_outcome<V>(grid);
  const Target target{
      .source = source.view(), .output = output.view(), .interpolation = interpolation, .background = 5};
  const Report report = resampler.resample(whole(grid), {&target, 1}, maps_of(maps));
  for (int n = 0; n < source.components; ++n) {
    const auto alone = run(resampler, source.component(n), {.interpolation = interpolation, .background = 5});
    EXPECT_TRUE(same_bits(alone.output.voxels, output.component(n).voxels)) << "component " << n;
    EXPECT_TRUE(same_bits(alone.coverage.voxels, maps.coverage.voxels));
    EXPECT_EQ(alone.report.covered, report.covered);
    EXPECT_EQ(alone.report.uncovered, report.uncovered);
    EXPECT_EQ(report.padded, 0u);
  }
}

TEST_P(Components, EachIsAVolumeOfItsOwnBitForBit) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  const Geometry grid = unit_grid({37, 15, 11});
  const auto resampler = make(grid);
  for (const int components : kCounts) {
    Random random(seed, static_cast<std::uint64_t>(components));
    const VertexField field = folding_field(grid, random);
    resampler->set_field(view(field, Outside::background));
    for (const Interpolation interpolation : kInterpolations) {
      for (int type = 0; type < 8; ++type) {
        dispatch(static_cast<VoxelType>(type), [&](auto voxel) {
          expect_components_alone(*resampler, random_vectors<decltype(voxel)>(grid, components, random), interpolation);
        });
      }
    }
  }
}

TEST_P(Components, SourcesOnAnotherGridToo) {
  Random random(test_seed());
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = oblique_grid({23, 15, 11});
  Geometry other = unit_grid({21, 23, 19});
  other.direction = rotation({-1, 0.3, 2}, 1.1);
  other.origin = centre(grid) - other.direction * glm::dvec3(10, 11, 9);
  const auto resampler = make(grid);
  const VertexField field = folding_field(grid, random);
  resampler->set_field(view(field));
  for (const Interpolation interpolation : kInterpolations) {
    expect_components_alone(*resampler, random_vectors<std::int16_t>(other, 3, random), interpolation);
    expect_components_alone(*resampler, random_vectors<double>(other, 3, random), interpolation);
  }
}

TEST_P(Components, PullFieldsToo) {
  Random random(test_seed());
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({23, 15, 11});
  const VertexField forward = folding_field(grid, random);
  const PullField field{forward.lattice, forward.displacement};
  const auto resampler = GetParam().make_pull(grid, {});
  resampler->set_field(view(field, Outside::background));
  for (const Interpolation interpolation : kInterpolations) {
    const auto source = random_vectors<std::int16_t>(grid, 3, random);
    Vectors<std::int16_t> output(grid, 3);
    const Target target{.source = source.view(), .output = output.view(), .interpolation = interpolation};
    resampler->resample(whole(grid), {&target, 1});
    for (int n = 0; n < 3; ++n) {
      const auto alone =
          run(*resampler, source.component(n), {.interpolation = interpolation, .background = 0, .pull = true});
      EXPECT_TRUE(same_bits(alone.output.voxels, output.component(n).voxels)) << "component " << n;
    }
  }
}

/// Without maps, so that tiles at rest are copied row by row.
TEST_P(Components, IdentityIsACopy) {
  Random random(test_seed());
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = oblique_grid({70, 34, 11});
  const auto resampler = make(grid);
  const VertexField field = uniform_field(lattice_over(grid, 4), glm::vec3(0));
  resampler->set_field(view(field));
  for (const int components : kCounts) {
    for (const Interpolation interpolation : kInterpolations) {
      const auto source = random_vectors<float>(grid, components, random);
      Vectors<float> output(grid, components);
      const Target target{.source = source.view(), .output = output.view(), .interpolation = interpolation};
      const Report report = resampler->resample(whole(grid), {&target, 1});
      EXPECT_TRUE(same_bits(source.values, output.values));
      EXPECT_EQ(report.covered, static_cast<std::uint64_t>(voxel_count(grid)));
      EXPECT_EQ(report.uncovered + report.clamped + report.padded, 0u);
    }
  }
}

/// A part of the output, in views that hold no more than they must: rows and slices of theirs.
TEST_P(Components, RegionsNeedNoMoreThanTheirPartOfTheSource) {
  Random random(test_seed());
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({37, 25, 21});
  const auto resampler = make(grid);
  const VertexField field = folding_field(grid, random);
  resampler->set_field(view(field));
  for (const Interpolation interpolation : kInterpolations) {
    for (const int components : kCounts) {
      const auto source = random_vectors<std::uint16_t>(grid, components, random);
      Vectors<std::uint16_t> expected(grid, components);
      const Target all{
          .source = source.view(), .output = expected.view(), .interpolation = interpolation, .background = 5};
      resampler->resample(whole(grid), {&all, 1});
      const Region region{{3, 5, 2}, {36, 11, 9}};
      const Region needed = resampler->source_region(grid, region);
      Vectors<std::uint16_t> held(grid, components), output(grid, components), untouched(grid, components);
      std::size_t to = 0;
      for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
        if (!contains(needed, {voxel, voxel + std::int64_t{1}})) return;
        const auto width = static_cast<std::size_t>(components);
        std::copy_n(source.values.data() + n * width, width, held.values.data() + width * to++);
      });
      const Target target{
          .source = held.view(needed), .output = output.view(region), .interpolation = interpolation, .background = 5};
      resampler->resample(region, {&target, 1});
      std::size_t from = 0;
      for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
        if (!contains(region, {voxel, voxel + std::int64_t{1}})) return;
        for (int c = 0; c < components; ++c) {
          const auto width = static_cast<std::size_t>(components), at = static_cast<std::size_t>(c);
          ASSERT_EQ(output.values[from * width + at], expected.values[n * width + at]) << to_string(voxel);
        }
        ++from;
      });
      const auto written = static_cast<std::ptrdiff_t>(from) * components;
      EXPECT_TRUE(std::equal(output.values.begin() + written, output.values.end(), untouched.values.begin() + written))
          << "values beyond the region were written";
    }
  }
}

/// A device that cannot hold everything takes slabs.
TEST_P(Components, ScarceMemoryGivesTheBitsOfTheCpu) {
  Random random(test_seed());
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({40, 30, 64});
  const VertexField field = field_in_voxels(grid, lattice_over(grid, 8), [&](const glm::dvec3&) {
    return 2.0 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
  const auto source = random_vectors<double>(grid, 3, random);
  const std::size_t bytes = source.values.size() * sizeof(double);
  Vectors<double> expected(grid, 3), found(grid, 3);
  const auto cpu = make_cpu_resampler(grid), scarce = GetParam().make(grid, {.memory = bytes});
  for (const Interpolation interpolation : kInterpolations) {
    const auto resample = [&](ForwardResampler& resampler, Vectors<double>& output) {
      resampler.set_field(view(field));
      const Target target{.source = source.view(), .output = output.view(), .interpolation = interpolation};
      return resampler.resample(whole(grid), {&target, 1});
    };
    expect_same_report(resample(*cpu, expected), resample(*scarce, found));
    EXPECT_TRUE(same_bits(expected.values, found.values));
  }
}

TEST_P(Components, AnyNumberOfTargetsOfAnyNumberOfComponents) {
  Random random(test_seed());
  SCOPED_TRACE(seed_text(test_seed()));
  const Geometry grid = unit_grid({37, 15, 11});
  const auto resampler = make(grid);
  const VertexField field = folding_field(grid, random);
  resampler->set_field(view(field));
  const auto ct = random_values<std::int16_t>(grid, random, -1000, 2000);
  const auto vectors = random_vectors<float>(grid, 3, random);
  const auto labels = random_vectors<std::uint8_t>(grid, 2, random);
  auto ct_output = poisoned<std::int16_t>(grid);
  Vectors<float> vectors_output(grid, 3), vectors_alone(grid, 3);
  Vectors<std::uint8_t> labels_output(grid, 2), labels_alone(grid, 2);
  const Target targets[] = {
      {.source = view(ct), .output = view(ct_output), .background = -7},
      {.source = vectors.view(), .output = vectors_output.view()},
      {.source = labels.view(), .output = labels_output.view(), .interpolation = Interpolation::vote, .background = 3}};
  resampler->resample(whole(grid), targets);
  Target alone[] = {targets[1], targets[2]};
  alone[0].output = vectors_alone.view();
  alone[1].output = labels_alone.view();
  for (const Target& target : alone) resampler->resample(whole(grid), {&target, 1});
  EXPECT_TRUE(same_bits(run(*resampler, ct).output.voxels, ct_output.voxels));
  EXPECT_TRUE(same_bits(vectors_alone.values, vectors_output.values));
  EXPECT_TRUE(same_bits(labels_alone.values, labels_output.values));
}

/// A step from 0 to 255 along i of which cubic interpolation overshoots on both sides.
std::uint8_t step_at(std::int64_t i, std::int64_t voxel) { return voxel < i ? 0 : 255; }

TEST_P(Components, AVoxelIsClampedOnceHoweverManyOfItsValuesAre) {
  const Geometry grid = unit_grid({12, 6, 6});
  Vectors<std::uint8_t> source(grid, 4);
  for_each_voxel(grid, [&](const glm::i64vec3& v, std::size_t n) {
    const std::uint8_t values[] = {step_at(4, v.x), 100, step_at(9, v.x), step_at(4, v.x)};
    std::copy_n(values, 4, source.values.data() + 4 * n);
  });
  const auto resampler = make(grid);
  const VertexField field = uniform_field(wide_lattice(grid), {0.5f, 0, 0});
  resampler->set_field(view(field));
  Vectors<std::uint8_t> output(grid, 4);
  const Target target{.source = source.view(), .output = output.view(), .interpolation = Interpolation::cubic};
  const Report report = resampler->resample(whole(grid), {&target, 1});
  EXPECT_EQ(report.clamped, 4u * 36u);  // -16 before each step, 271 after it: two voxels of a row for each of two steps
  EXPECT_EQ(report.covered, 12u * 36u);
}

TEST_P(Components, EveryOneGetsTheBackgroundWhichIsClampedOnceAVoxel) {
  const Geometry grid = unit_grid({4, 4, 4});
  Vectors<std::uint8_t> source(grid, 3), output(grid, 3);
  const auto resampler = make(grid);
  const VertexField field = uniform_field(wide_lattice(grid), {100, 0, 0});
  resampler->set_field(view(field));
  const Target target{.source = source.view(), .output = output.view(), .background = 300};
  const Report report = resampler->resample(whole(grid), {&target, 1});
  EXPECT_TRUE(same_bits(std::vector<std::uint8_t>(192, 255), output.values));
  EXPECT_EQ(report.uncovered, 64u);
  EXPECT_EQ(report.clamped, 64u);
}

TEST_P(Components, SlicesThatWereReadAreNotedOnceForAll) {
  Random random(test_seed());
  const Geometry grid = unit_grid({9, 8, 11});
  const auto resampler = make(grid);
  const VertexField field = folding_field(grid, random);
  resampler->set_field(view(field));
  for (const Interpolation interpolation : kInterpolations) {
    const auto source = random_vectors<float>(grid, 3, random);
    const auto first = source.component(0);
    Vectors<float> output(grid, 3);
    auto alone = poisoned<float>(grid);
    std::vector<SliceRange> slices(11), slices_alone(11);
    const Target target{
        .source = source.view(), .output = output.view(), .interpolation = interpolation, .sampled_slices = slices};
    const Target target_alone{
        .source = view(first), .output = view(alone), .interpolation = interpolation, .sampled_slices = slices_alone};
    resampler->resample(whole(grid), {&target, 1});
    resampler->resample(whole(grid), {&target_alone, 1});
    for (std::size_t k = 0; k < slices.size(); ++k) {
      EXPECT_EQ(slices[k].first, slices_alone[k].first) << "slice " << k;
      EXPECT_EQ(slices[k].last, slices_alone[k].last) << "slice " << k;
    }
  }
}

TEST_P(Components, PaddingIsRefused) {
  const Geometry grid = unit_grid({5, 4, 3});
  const auto resampler = make(grid);
  const VertexField field = uniform_field(lattice_over(grid, 1), glm::vec3(0));
  resampler->set_field(view(field));
  Vectors<std::int16_t> source(grid, 2), output(grid, 2);
  const Target target{.source = source.view(), .output = output.view(), .padding = PaddingRange{-2000, -2000}};
  try {
    resampler->resample(whole(grid), {&target, 1});
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("padding is for one value a voxel, the source has 2 components"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace tetwarp
