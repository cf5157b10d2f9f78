// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Rows sampled with vectors, for every instruction set that the processor has, against one voxel after the other.
#include "deform/cpu/rows/linear_row.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>

#include "tests/support/instruction_set.h"
#include "tests/support/random.h"

namespace tetwarp::cpu {
namespace {

using namespace test;

template <class V>
class LinearRow : public testing::Test {};

using Types = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, float>;
TYPED_TEST_SUITE(LinearRow, Types);

/// Any value of a type; of floats also both zeros, infinities, and NaN with a payload.
template <class V>
V random_value(Random& random) {
  using Limits = std::numeric_limits<V>;
  if constexpr (std::is_integral_v<V>) {
    return static_cast<V>(random.integer(Limits::lowest(), Limits::max()));
  } else {
    const V rare[] = {0.0f,
                      -0.0f,
                      Limits::infinity(),
                      -Limits::infinity(),
                      Limits::max(),
                      Limits::denorm_min(),
                      std::bit_cast<float>(0x7fc12345u)};
    return random.chance(0.4) ? random.one_of(rare) : static_cast<float>(random.real(-2000, 2000));
  }
}

/// One of few labels, so that they meet; of floats also both zeros and NaN with two payloads.
template <class V>
V random_label(Random& random) {
  using Limits = std::numeric_limits<V>;
  if constexpr (std::is_integral_v<V>) {
    const V labels[] = {Limits::lowest(), 0, 3, static_cast<V>(Limits::max() - 1), Limits::max()};
    return random.one_of(labels);
  } else {
    const V labels[] = {0.0f, -0.0f, 3.0f, Limits::infinity(), std::bit_cast<float>(0x7fc12345u), Limits::quiet_NaN()};
    return random.one_of(labels);
  }
}

/// Offsets of all kinds: none, whole, halves, just below whole, tiny, and any; some lead out of the source.
float random_offset(Random& random) {
  const double whole = static_cast<double>(random.integer(-6, 6));
  switch (random.integer(0, 5)) {
    case 0: return 0.0f;
    case 1: return static_cast<float>(whole);
    case 2: return static_cast<float>(whole + 0.5);
    case 3: return std::nextafter(static_cast<float>(whole), -100.0f);
    case 4: return -1e-9f;
    default: return static_cast<float>(random.real(-7, 7));
  }
}

/// Offsets of a row of a field.
template <class Offset>
struct RowOffsets;
template <>
struct RowOffsets<glm::vec3> {  // of a dense one
  glm::vec3 offset[kRoomTogether];

  void fill(Random& random, int i) {
    offset[i] = {random_offset(random), random_offset(random), random_offset(random)};
  }
  template <class Voxels>
  void put(Voxels& voxels) const {
    voxels.offset = offset;
  }
  glm::vec3 at(int i) const { return offset[i]; }
};
template <>
struct RowOffsets<FixedOffset> {  // of a coarse one
  std::int32_t u[3][kRoomTogether];
  FixedOffsets fixed{{u[0], u[1], u[2]}, {}};

  void fill(Random& random, int i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double voxels = random_offset(random);
      const auto some = static_cast<std::int32_t>(std::lrint(voxels * 0x1p23));
      u[axis][i] = random.chance(0.1) ? static_cast<std::int32_t>(random.integer(-3, 3)) : some;
    }
  }
  template <class Voxels>
  void put(Voxels& voxels) const {
    voxels.fixed = &fixed;
  }
  FixedOffset at(int i) const { return fixed.at(i); }
};

/// Samples rows of a part of a source with vectors, for every instruction set, and each voxel by itself.
/// @tparam Offset  glm::vec3: of a dense field; FixedOffset: of a coarse one
/// @param value  makes a voxel of the source
template <Interpolation kInterpolation, class Offset, class V>
void expect_same_bits(V (*value)(Random&),
                      void (*sample)(const LinearSource& source, const LinearPlaces& places, void* output)) {
  SCOPED_TRACE(seed_text(test_seed()));
  const glm::i64vec3 size(37, 9, 11);
  const Region held{{2, 1, 3}, {37, 9, 10}};
  const glm::i64vec3 in = held.end - held.begin;
  int sampled = 0, sets = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    ++sets;
    Random random(test_seed(), 40);
    std::vector<V> voxels(static_cast<std::size_t>(in.x * in.y * in.z));
    for (V& voxel : voxels) voxel = value(random);
    SamplePlan<V> plan{};
    plan.source = {voxels.data(), size, held.begin, glm::i64vec3(1, in.x, in.x * in.y)};
    plan.background = 77;
    plan.relation.same_grid = true;
    LinearSource source;
    ASSERT_TRUE(LinearSource::make(plan, static_cast<std::int64_t>(voxels.size()), source));
    for (int n = 0; n < 400; ++n) {
      constexpr int kCount = 35;
      std::uint8_t mapped[kCount];
      RowOffsets<Offset> offsets;
      Row row{{random.integer(0, 3), random.integer(3, 6), random.integer(5, 7)}, kCount, mapped, nullptr};
      offsets.put(row);
      for (int i = 0; i < kCount; ++i) {
        offsets.fill(random, i);
        const glm::i64vec3 voxel = row.voxel + glm::i64vec3(i, 0, 0);
        // What a caller promises: all that counts is buffered.
        const Place place = place_at(voxel, offsets.at(i));
        const bool promised = glm::all(glm::greaterThanEqual(place.base, held.begin)) &&
                              glm::all(glm::lessThan(place.base + std::int64_t{1}, held.end));
        mapped[i] = promised && random.integer(0, 9) != 0;
      }
      V output[kCount];
      LinearPlaces places;
      places.find(source.layout, row);
      sample(source, places, output);
      SliceRange expected_slices;
      for (int i = 0; i < kCount; ++i) {
        if (places.state[i] == RowState::left) continue;
        ASSERT_EQ(places.state[i], RowState::sampled);
        const SampledVoxel<V> expected =
            sample_voxel<V, kInterpolation>(plan, row.voxel + glm::i64vec3(i, 0, 0), mapped[i] != 0, offsets.at(i));
        ASSERT_TRUE(expected.inside);
        ASSERT_EQ(std::memcmp(&output[i], &expected.value, sizeof(V)), 0)
            << hwy::TargetName(target) << ", voxel " << i << ": " << +output[i] << ", expected " << +expected.value;
        expected_slices.first = std::min(expected_slices.first, expected.first_slice);
        expected_slices.last = std::max(expected_slices.last, expected.last_slice);
        ++sampled;
      }
      if (kInterpolation == Interpolation::nearest) continue;
      ASSERT_EQ(places.slices.first, expected_slices.first);
      ASSERT_EQ(places.slices.last, expected_slices.last);
    }
  }
  EXPECT_GT(sampled, 1000 * sets) << "hardly anything is sampled with vectors";
}

/// The same of lists of voxels, from a source that is held as a whole.
template <Interpolation kInterpolation, class Offset, class V>
void expect_same_bits_in_lists(V (*value)(Random&),
                               void (*sample)(const LinearSource& source, const LinearPlaces& places, void* output)) {
  SCOPED_TRACE(seed_text(test_seed()));
  const glm::i64vec3 size(47, 31, 29);
  int sampled = 0, sets = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    ++sets;
    Random random(test_seed(), 41);
    std::vector<V> voxels(static_cast<std::size_t>(size.x * size.y * size.z));
    for (V& voxel : voxels) voxel = value(random);
    SamplePlan<V> plan{};
    plan.source = {voxels.data(), size, glm::i64vec3(0), glm::i64vec3(1, size.x, size.x * size.y)};
    plan.relation.same_grid = true;
    LinearSource source;
    ASSERT_TRUE(LinearSource::make(plan, static_cast<std::int64_t>(voxels.size()), source));
    for (int n = 0; n < 50; ++n) {
      std::uint16_t numbers[kRoomTogether];
      for (std::uint16_t& number : numbers) number = static_cast<std::uint16_t>(random.integer(0, 32767));
      RowOffsets<Offset> offsets;
      VoxelList list{{random.integer(0, 20), random.integer(0, 9), random.integer(0, 9)},
                     static_cast<int>(random.integer(1, kMostTogether)),
                     numbers,
                     nullptr,
                     nullptr};
      offsets.put(list);
      for (int i = 0; i < list.count; ++i) offsets.fill(random, i);
      V output[kRoomTogether];
      std::int32_t steps[kRoomTogether];
      LinearPlaces places;
      places.find(source.layout, list);
      sample(source, places, output);
      find_steps(list, 100, 10000, steps);
      int found = 0;
      for (int i = 0; i < list.count; ++i) {
        const glm::ivec3 in = list.in_tile_at(i);
        ASSERT_EQ(steps[i], in.x + 100 * in.y + 10000 * in.z) << hwy::TargetName(target);
        if (places.state[i] == RowState::left) continue;
        ++found;
        const SampledVoxel<V> expected = sample_voxel<V, kInterpolation>(plan, list.voxel_at(i), true, offsets.at(i));
        ASSERT_TRUE(expected.inside);
        ASSERT_EQ(std::memcmp(&output[i], &expected.value, sizeof(V)), 0)
            << hwy::TargetName(target) << ", voxel " << i << ": " << +output[i] << ", expected " << +expected.value;
        if (kInterpolation == Interpolation::nearest) continue;
        ASSERT_EQ(places.slice[i], expected.first_slice);
        ASSERT_EQ(places.slice[i] + (places.z[i] != 0), expected.last_slice);
      }
      ASSERT_EQ(places.sampled, found);
      sampled += found;
    }
  }
  EXPECT_GT(sampled, 1000 * sets) << "hardly anything is sampled with vectors";
}

TYPED_TEST(LinearRow, GivesTheBitsOfOneVoxelAfterTheOtherInLists) {
  expect_same_bits_in_lists<Interpolation::linear, glm::vec3>(&random_value<TypeParam>, &sample_linear_row);
  expect_same_bits_in_lists<Interpolation::linear, FixedOffset>(&random_value<TypeParam>, &sample_linear_row);
  expect_same_bits_in_lists<Interpolation::vote, FixedOffset>(&random_label<TypeParam>, &sample_vote_row);
}

/// Reads the nearest voxels of a source.
template <class V>
void sample_nearest_voxels(const LinearSource& source, const LinearPlaces& places, void* output) {
  sample_nearest_row(source.layout, static_cast<const V*>(source.voxels), places, static_cast<V*>(output));
}

TYPED_TEST(LinearRow, FindsTheNearestVoxelOfOneAfterTheOther) {
  expect_same_bits<Interpolation::nearest, glm::vec3>(&random_value<TypeParam>, &sample_nearest_voxels<TypeParam>);
  expect_same_bits<Interpolation::nearest, FixedOffset>(&random_value<TypeParam>, &sample_nearest_voxels<TypeParam>);
  expect_same_bits_in_lists<Interpolation::nearest, FixedOffset>(&random_value<TypeParam>,
                                                                 &sample_nearest_voxels<TypeParam>);
}

TYPED_TEST(LinearRow, GivesTheBitsOfOneVoxelAfterTheOtherOnEveryInstructionSet) {
  expect_same_bits<Interpolation::linear, glm::vec3>(&random_value<TypeParam>, &sample_linear_row);
}

TYPED_TEST(LinearRow, GivesTheBitsOfOneVoxelAfterTheOtherInCoarseFields) {
  expect_same_bits<Interpolation::linear, FixedOffset>(&random_value<TypeParam>, &sample_linear_row);
}

TYPED_TEST(LinearRow, VotesAsOneVoxelAfterTheOtherOnEveryInstructionSet) {
  expect_same_bits<Interpolation::vote, glm::vec3>(&random_label<TypeParam>, &sample_vote_row);
  expect_same_bits<Interpolation::vote, FixedOffset>(&random_label<TypeParam>, &sample_vote_row);
}

/// 0.75 of the way from -2^-60 to 1 + 2^-23 lies a little below the middle of two floats. Rounded to double first it
/// would be the middle, and then the even one, which is the larger.
TEST(LinearRowRounding, OfCoarseFieldsIsDoneOnceOnEveryInstructionSet) {
  constexpr int kWidth = 40, kCount = 32;
  std::vector<float> voxels;
  for (int n = 0; n < kWidth * 4; ++n) voxels.push_back(n % 2 == 0 ? -0x1p-60f : 1.0f + 0x1p-23f);
  SamplePlan<float> plan{};
  plan.source = {voxels.data(), {kWidth, 2, 2}, glm::i64vec3(0), {1, kWidth, 2 * kWidth}};
  plan.relation.same_grid = true;
  LinearSource source;
  ASSERT_TRUE(LinearSource::make(plan, static_cast<std::int64_t>(voxels.size()), source));
  std::int32_t u[3][kMostTogether] = {};
  std::uint8_t mapped[kCount];
  for (int i = 0; i < kCount; ++i) {
    u[0][i] = 3 << 21;
    mapped[i] = 1;
  }
  const FixedOffsets fixed{{u[0], u[1], u[2]}, {}};
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const OnInstructionSet on(target);
    const Row row{{0, 0, 0}, kCount, mapped, nullptr, &fixed};
    LinearPlaces places;
    places.find(source.layout, row);
    ASSERT_EQ(places.sampled, kCount);
    float output[kCount];
    sample_linear_row(source, places, output);
    for (int i = 0; i < kCount; i += 2) EXPECT_EQ(output[i], 0.75f + 0x1p-24f) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace tetwarp::cpu
