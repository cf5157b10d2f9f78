// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Rows sampled with vectors, for every instruction set that the processor has, against one voxel after the other.
#include "deform/cpu/linear_row.h"

#include <gtest/gtest.h>

#include <hwy/targets.h>

#include "tests/support/random.h"

namespace tetwarp::cpu {
namespace {

using namespace test;

template <class V>
class LinearRow : public testing::Test {
 protected:
  ~LinearRow() override { hwy::SetSupportedTargetsForTest(0); }
};

using Types = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t>;
TYPED_TEST_SUITE(LinearRow, Types);

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

TYPED_TEST(LinearRow, GivesTheBitsOfOneVoxelAfterTheOtherOnEveryInstructionSet) {
  using V = TypeParam;
  SCOPED_TRACE(seed_text(test_seed()));
  const glm::i64vec3 size(37, 9, 11);
  const Region held{{2, 1, 3}, {37, 9, 10}};
  const glm::i64vec3 in = held.end - held.begin;
  int sampled = 0, sets = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    ++sets;
    Random random(test_seed(), 40);
    std::vector<V> voxels(static_cast<std::size_t>(in.x * in.y * in.z));
    for (V& voxel : voxels)
      voxel = static_cast<V>(random.integer(std::numeric_limits<V>::lowest(), std::numeric_limits<V>::max()));
    SamplePlan<V> plan{};
    plan.source = {voxels.data(), size, held.begin, glm::i64vec3(1, in.x, in.x * in.y)};
    plan.background = 77;
    plan.relation.same_grid = true;
    LinearSource source;
    ASSERT_TRUE(LinearSource::make(plan, static_cast<std::int64_t>(voxels.size()), source));
    for (int n = 0; n < 400; ++n) {
      constexpr int kCount = 35;
      std::uint8_t mapped[kCount];
      glm::vec3 offset[kCount];
      Row row{{random.integer(0, 3), random.integer(3, 6), random.integer(5, 7)}, kCount, mapped, offset};
      for (int i = 0; i < kCount; ++i) {
        offset[i] = {random_offset(random), random_offset(random), random_offset(random)};
        const glm::i64vec3 voxel = row.voxel + glm::i64vec3(i, 0, 0);
        // What a caller promises: all that counts is buffered.
        const Place place = place_at(voxel, offset[i]);
        const bool promised = glm::all(glm::greaterThanEqual(place.base, held.begin)) &&
                              glm::all(glm::lessThan(place.base + std::int64_t{1}, held.end));
        mapped[i] = promised && random.integer(0, 9) != 0;
      }
      V output[kCount];
      LinearPlaces places;
      places.find(source.layout, row);
      sample_linear_row(source, places, output);
      SliceRange expected_slices;
      for (int i = 0; i < kCount; ++i) {
        if (places.state[i] == RowState::left) continue;
        ASSERT_EQ(places.state[i], RowState::sampled);
        const SampledVoxel<V> expected =
            sample_voxel<V, Interpolation::linear>(plan, row.voxel + glm::i64vec3(i, 0, 0), mapped[i] != 0, offset[i]);
        ASSERT_TRUE(expected.inside);
        ASSERT_EQ(output[i], expected.value) << hwy::TargetName(target) << ", voxel " << i;
        expected_slices.first = std::min(expected_slices.first, expected.first_slice);
        expected_slices.last = std::max(expected_slices.last, expected.last_slice);
        ++sampled;
      }
      ASSERT_EQ(places.slices.first, expected_slices.first);
      ASSERT_EQ(places.slices.last, expected_slices.last);
    }
  }
  EXPECT_GT(sampled, 1000 * sets) << "hardly anything is sampled with vectors";
}

}  // namespace
}  // namespace tetwarp::cpu
