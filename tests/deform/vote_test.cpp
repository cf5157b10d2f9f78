// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Interpolation::vote, against volumes that have 1 where a label is and 0 elsewhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "tests/support/backends.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

TETWARP_BACKEND_SUITE(Vote);

constexpr double kClear = 1e-5;  ///< the least difference of two sums of weights that float tells apart

/// Labels in lumps, single voxels of others strewn in: from the ends of the type's range and from its middle.
template <class V>
Volume<V> label_map(const Geometry& grid, Random& random) {
  using Limits = std::numeric_limits<V>;
  const V labels[] = {Limits::lowest(), Limits::max(), V(0), V(1), V(7), static_cast<V>(Limits::max() - 1)};
  const std::int64_t lump = random.integer(1, 4);
  Volume<V> volume{grid, {}};
  std::vector<V> of_lump(1000);
  for (V& label : of_lump) label = random.one_of(labels);
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t) {
    const glm::i64vec3 at = voxel / lump;
    const auto n = static_cast<std::size_t>(at.x + 7 * at.y + 31 * at.z) % of_lump.size();
    volume.voxels.push_back(random.chance(0.05) ? random.one_of(labels) : of_lump[n]);
  });
  return volume;
}

/// Resamples one 0/1 volume for each label, linearly in double. @return for each voxel the label with the largest sum;
/// unclear where two sums are about the same
template <class V>
struct OneHot {
  std::vector<V> winner;
  std::vector<std::uint8_t> is_clear;

  OneHot(Resampler& resampler, const Volume<V>& source) {
    const std::set<V> labels(source.voxels.begin(), source.voxels.end());
    const auto voxels = static_cast<std::size_t>(voxel_count(resampler.output()));
    std::vector<double> most(voxels, -1), second(voxels, -1);
    winner.resize(voxels);
    for (const V label : labels) {
      Volume<double> one{source.geometry, {}}, weight = poisoned<double>(resampler.output());
      for (const V voxel : source.voxels) one.voxels.push_back(voxel == label);
      const Target target{.source = view(one), .output = view(weight)};
      resampler.resample(whole(resampler.output()), {&target, 1});
      for (std::size_t n = 0; n < voxels; ++n) {
        second[n] = std::max(second[n], std::min(most[n], weight.voxels[n]));
        if (weight.voxels[n] > most[n]) winner[n] = label;
        most[n] = std::max(most[n], weight.voxels[n]);
      }
    }
    for (std::size_t n = 0; n < voxels; ++n) is_clear.push_back(most[n] - second[n] > kClear);
  }
};

/// @return voxels that were compared
template <class V>
std::size_t expect_like_one_hot(Resampler& resampler, const Volume<V>& source, V background) {
  const OneHot<V> expected(resampler, source);
  const auto found =
      run(resampler, source, {.interpolation = Interpolation::vote, .background = static_cast<double>(background)});
  const auto linear = run(resampler, source, {.background = static_cast<double>(background)});
  EXPECT_TRUE(same_bits(linear.coverage.voxels, found.coverage.voxels));
  std::size_t clear = 0, wrong = 0;
  for (std::size_t n = 0; n < found.output.voxels.size(); ++n) {
    if (found.coverage.voxels[n] == 0) {
      wrong += found.output.voxels[n] != background;
    } else if (expected.is_clear[n]) {
      ++clear;
      wrong += found.output.voxels[n] != expected.winner[n];
    }
  }
  EXPECT_EQ(wrong, 0u) << "of " << clear << " voxels that can be told";
  EXPECT_EQ(found.report.clamped, 0u);
  expect_same_report(linear.report, found.report);
  return clear;
}

template <class Test>
void for_each_type(Test&& test) {
  for (int type = 0; type < 8; ++type) {
    SCOPED_TRACE(to_string(static_cast<VoxelType>(type)));
    dispatch(static_cast<VoxelType>(type), test);
  }
}

TEST_P(Vote, TheLargestOfTheOneHotVolumesWinsWhereverFieldsFoldOrNot) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  std::size_t clear = 0;
  for (std::uint64_t number = 0; number < test_cases(20); ++number) {
    Random random(seed, number);
    const FieldCase test = number % 2 == 0 ? random_injective_case(random) : random_folding_case(random);
    SCOPED_TRACE("case " + std::to_string(number) + ": " + test.description);
    const auto resampler = make(test.output);
    resampler->set_field(view(test.field, Outside::background));
    for_each_type([&](auto voxel) {
      using V = decltype(voxel);
      clear += expect_like_one_hot(*resampler, label_map<V>(test.output, random), V(5));
    });
  }
  EXPECT_GT(clear, 20 * test_cases(20));
}

/// Rows of many voxels, some of one label all around and some not.
TEST_P(Vote, SoItDoesInWideGrids) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({70, 21, 12});
  const auto resampler = make(grid);
  for (const double amplitude : {0.3, 1.2}) {  // voxels, of cells of 4: without folds and with
    const VertexField field = field_in_voxels(grid, lattice_over(grid, 4), [&](const glm::dvec3& x) {
      return x.x > 50 ? glm::dvec3(0)
                      : 4 * amplitude * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    resampler->set_field(view(field));
    for_each_type([&](auto voxel) {
      using V = decltype(voxel);
      const std::size_t clear = expect_like_one_hot(*resampler, label_map<V>(grid, random), V(5));
      EXPECT_GT(clear, 10'000u);
    });
  }
}

TEST_P(Vote, SourcesOnAnotherGridToo) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = oblique_grid({23, 19, 14});
  Geometry other = unit_grid({21, 23, 19});
  other.spacing = {1.1, 0.9, 1.7};
  other.direction = rotation({-1, 0.3, 2}, 1.1);
  other.origin = centre(grid) - other.direction * (other.spacing * glm::dvec3(10, 11, 9));
  const auto resampler = make(grid);
  const VertexField field = field_in_voxels(grid, lattice_over(grid, 3), [&](const glm::dvec3&) {
    return 1.5 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
  resampler->set_field(view(field));
  for_each_type([&](auto voxel) {
    using V = decltype(voxel);
    EXPECT_GT(expect_like_one_hot(*resampler, label_map<V>(other, random), V(5)), 1000u);
  });
}

/// The formula in double, with no other resampling beside it: at the border too, where places are clamped.
TEST_P(Vote, SumsAreOfTheLinearWeights) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({12, 9, 10});
  const auto resampler = make(grid);
  for (int number = 0; number < 20; ++number) {
    const auto steps = [&] { return static_cast<double>(random.integer(-8192, 8192)) / 4096; };
    const glm::dvec3 shift(steps(), steps(), steps());
    SCOPED_TRACE("shift " + std::to_string(shift.x) + " " + std::to_string(shift.y) + " " + std::to_string(shift.z));
    for_each_type([&](auto voxel) {
      using V = decltype(voxel);
      const auto source = label_map<V>(grid, random);
      const auto found =
          run_shifted(*resampler, source, shift, {.interpolation = Interpolation::vote, .background = 5});
      for_each_voxel(grid, [&](const glm::i64vec3& at, std::size_t n) {
        const auto expected = reference_sample(source, glm::dvec3(at) - shift, Interpolation::vote);
        ASSERT_EQ(found.coverage.voxels[n], expected.inside) << to_string(at);
        if (expected.inside && expected.jump * 6 <= kClear) return;
        ASSERT_EQ(+found.output.voxels[n], expected.inside ? +static_cast<V>(expected.value) : +V(5)) << to_string(at);
      });
    });
  }
}

/// What a vote between eight corners gives, labels in the order x + 2y + 4z, at one place between them.
template <class V>
V vote_of(ForwardResampler& resampler, const std::vector<V>& corners, const glm::dvec3& fraction) {
  const Volume<V> source{unit_grid({2, 2, 2}), corners};
  return run_shifted(resampler, source, -fraction, {.interpolation = Interpolation::vote, .background = 99})
      .output.voxels[0];
}

/// Labels of a type that its values tell apart: low < middle < high.
template <class V>
struct Three {
  V low = std::numeric_limits<V>::lowest(), middle = V(3), high = std::numeric_limits<V>::max();
};

TEST_P(Vote, TiesGoToTheSmallerLabelWhereverItLies) {
  const auto resampler = make(unit_grid({2, 2, 2}));
  for_each_type([&](auto voxel) {
    using V = decltype(voxel);
    const auto [a, b, c] = Three<V>();
    const V d = V(5);
    for (int axis = 0; axis < 3; ++axis) {  // two halves
      glm::dvec3 half(0);
      half[axis] = 0.5;
      std::vector<V> rising(8), falling(8);
      for (int n = 0; n < 8; ++n) {
        rising[static_cast<std::size_t>(n)] = (n >> axis & 1) != 0 ? c : a;
        falling[static_cast<std::size_t>(n)] = (n >> axis & 1) != 0 ? a : c;
      }
      EXPECT_EQ(vote_of(*resampler, rising, half), a);
      EXPECT_EQ(vote_of(*resampler, falling, half), a);
    }
    const glm::dvec3 xy(0.5, 0.5, 0), yz(0, 0.5, 0.5), middle(0.5);
    std::vector<V> four = {c, b, d, a};  // a quarter each, in any order
    std::sort(four.begin(), four.end());
    do {
      EXPECT_EQ(vote_of<V>(*resampler, {four[0], four[1], four[2], four[3], c, c, c, c}, xy), a);
      EXPECT_EQ(vote_of<V>(*resampler, {four[0], c, four[1], c, four[2], c, four[3], c}, yz), a);
    } while (std::next_permutation(four.begin(), four.end()));
    EXPECT_EQ(vote_of<V>(*resampler, {d, b, b, d, c, c, c, c}, xy), b);               // two quarters each
    EXPECT_EQ(vote_of<V>(*resampler, {c, c, d, d, b, b, b, c}, middle), b);           // 3/8, 3/8, 2/8
    EXPECT_EQ(vote_of<V>(*resampler, {a, c, c, d, d, b, b, V(9)}, middle), b);        // three of 2/8
    EXPECT_EQ(vote_of<V>(*resampler, {c, b, d, b, a, a, a, a}, {0.25, 0.25, 0}), c);  // 9/16 beats all
  });
}

/// The winner of two labels, by sums in float: weights along x, y and z multiplied in this order, or from z on; summed
/// from corner 0 on, or from 7.
struct FloatVote {
  bool from_z = false, from_corner_7 = false;

  int operator()(const std::vector<int>& corners, const glm::vec3& t) const {
    const auto factor = [&](int axis, std::size_t corner) { return corner >> axis & 1 ? t[axis] : 1 - t[axis]; };
    float sums[2] = {};
    for (std::size_t n = 0; n < 8; ++n) {
      const std::size_t corner = from_corner_7 ? 7 - n : n;
      const float x = factor(0, corner), y = factor(1, corner), z = factor(2, corner);
      sums[corners[corner]] += from_z ? x * (y * z) : x * y * z;
    }
    return sums[1] > sums[0] ? 1 : 0;
  }
};

/// A place along x where two labels have half of the weight each, near enough; NaN where there is none.
double balance(const std::vector<int>& corners, const glm::vec3& t) {
  double at[2] = {};  // the weight of label 1 on either side
  for (std::size_t n = 0; n < 8; ++n) {
    const double y = (n >> 1 & 1) != 0 ? t.y : 1.0 - t.y, z = n >> 2 != 0 ? t.z : 1.0 - t.z;
    at[n & 1] += corners[n] * y * z;
  }
  const double x = (0.5 - at[0]) / (at[1] - at[0]);
  return x > 0.01 && x < 0.99 ? x : std::numeric_limits<double>::quiet_NaN();
}

/// Places where another order of operations would let the other label win.
TEST_P(Vote, WeightsAreMultipliedAndSummedInOneOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({2, 2, 2});
  const auto resampler = make(grid);
  const VertexField field = uniform_field(lattice_over(grid, 1), glm::vec3(0));
  resampler->set_field(view(field));
  int by_product = 0, by_sum = 0;
  for (int number = 0; number < 200'000 && std::min(by_product, by_sum) < 20; ++number) {
    std::vector<int> corners(8);
    for (int& label : corners) label = random.chance(0.5);
    glm::vec3 t(0, random.real(0.01, 0.99), random.real(0.01, 0.99));
    t.x = static_cast<float>(balance(corners, t));
    if (std::isnan(t.x)) continue;
    const int expected = FloatVote{}(corners, t);
    const bool product_decides = FloatVote{.from_z = true}(corners, t) != expected,
               sum_decides = FloatVote{.from_corner_7 = true}(corners, t) != expected;
    if (!product_decides && !sum_decides) continue;
    by_product += product_decides;
    by_sum += sum_decides;
    Volume<std::uint8_t> source{grid, {corners.begin(), corners.end()}};
    source.geometry.origin = -glm::dvec3(t);  // so that output voxel 0 comes from t, in all its bits
    const auto found = run(*resampler, source, {.interpolation = Interpolation::vote, .background = 9});
    ASSERT_EQ(+found.output.voxels[0], expected);
  }
  EXPECT_GE(std::min(by_product, by_sum), 20);
}

TEST_P(Vote, LabelsAreSummedBeforeTheyAreCompared) {
  const auto resampler = make(unit_grid({2, 2, 2}));
  for_each_type([&](auto voxel) {
    using V = decltype(voxel);
    const auto [a, b, c] = Three<V>();
    // Corner 0 is the heaviest and the nearest, with 27/64 of the weight; 37/64 are for another.
    EXPECT_EQ(vote_of<V>(*resampler, {a, c, c, c, c, c, c, c}, glm::dvec3(0.25)), c);
    // 27 + 9 of 64 are the most, though larger in value: then 9 + 9 + 3 + 3 and 3 + 1.
    EXPECT_EQ(vote_of<V>(*resampler, {c, a, a, a, c, a, b, b}, glm::dvec3(0.25)), c);
    // 1/2 at one end against 1/4 and 1/4 of another label.
    EXPECT_EQ(vote_of<V>(*resampler, {c, b, c, a, b, b, b, b}, {0.5, 0.5, 0}), c);
  });
}

TEST_P(Vote, CornersOfWeightZeroDoNotCount) {
  const auto resampler = make(unit_grid({2, 2, 2}));
  for_each_type([&](auto voxel) {
    using V = decltype(voxel);
    const auto [a, b, c] = Three<V>();
    EXPECT_EQ(vote_of<V>(*resampler, {b, c, a, a, a, a, a, a}, {0.25, 0, 0}), b);
    EXPECT_EQ(vote_of<V>(*resampler, {b, a, c, a, a, a, a, a}, {0, 0.5, 0}), b);
    EXPECT_EQ(vote_of<V>(*resampler, {b, a, a, a, c, a, a, a}, {0, 0, 0.25}), b);
    EXPECT_EQ(vote_of<V>(*resampler, {b, a, a, a, a, a, a, a}, {0, 0, 0}), b);
  });
}

TEST_P(Vote, NotANumberIsOneLabelLargerThanOthers) {
  const auto resampler = make(unit_grid({2, 2, 2}));
  const float n = std::numeric_limits<float>::quiet_NaN(), i = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(std::isnan(vote_of<float>(*resampler, {1, n, n, 2, 2, 2, 2, 2}, {0.5, 0.5, 0})));
  EXPECT_EQ(vote_of<float>(*resampler, {n, i, n, i, 2, 2, 2, 2}, {0.5, 0.5, 0}), i);
  EXPECT_EQ(vote_of<float>(*resampler, {i, n, i, n, 2, 2, 2, 2}, {0.5, 0.5, 0}), i);
  EXPECT_TRUE(std::isnan(vote_of<float>(*resampler, {n, n, n, n, n, n, n, n}, glm::dvec3(0.25))));
  EXPECT_TRUE(std::isnan(vote_of<float>(*resampler, {n, 1, n, 3, n, 5, n, 7}, glm::dvec3(0.25))));
}

/// Zeros of both signs are one label: the first corner says which is returned.
TEST_P(Vote, ZerosOfBothSignsAreOneLabel) {
  const auto resampler = make(unit_grid({2, 2, 2}));
  const double minus = vote_of<double>(*resampler, {-1, -0.0, 0.0, 2, 2, 2, 2, 2}, {0.5, 0.5, 0});
  EXPECT_EQ(minus, 0);
  EXPECT_TRUE(std::signbit(minus));
  const double plus = vote_of<double>(*resampler, {0.0, -0.0, -1, 2, 2, 2, 2, 2}, {0.5, 0.5, 0});
  EXPECT_EQ(plus, 0);
  EXPECT_FALSE(std::signbit(plus));
}

/// No label is made up, whatever the field; and a label map of wide integers keeps all their bits.
TEST_P(Vote, OnlyLabelsOfTheSourceComeOut) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({70, 41, 37});
  const auto resampler = make(grid);
  const VertexField field = field_in_voxels(grid, lattice_over(grid, 4), [&](const glm::dvec3& x) {
    return x.x > 50 ? glm::dvec3(0) : 3.0 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
  resampler->set_field(view(field));
  for_each_type([&](auto voxel) {
    using V = decltype(voxel);
    const auto source = label_map<V>(grid, random);
    std::set<V> labels(source.voxels.begin(), source.voxels.end());
    labels.insert(V(5));
    Volume<V> output = poisoned<V>(grid);
    const Target target{
        .source = view(source), .output = view(output), .interpolation = Interpolation::vote, .background = 5};
    resampler->resample(whole(grid), {&target, 1});
    for (const V label : output.voxels) ASSERT_TRUE(labels.contains(label)) << +label;
  });
}

/// Whole rows, their ends, single voxels, several threads and another backend use different code, and must agree in
/// close votes, too.
TEST_P(Vote, PartsAreThoseOfTheWholeOnOneThreadOfTheCpu) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({70, 41, 37});
  const auto resampler = make(grid), on_cpu = make_cpu_resampler(grid, {.threads = 1});
  const VertexField field = field_in_voxels(grid, lattice_over(grid, 8), [&](const glm::dvec3&) {
    return 2.0 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
  });
  resampler->set_field(view(field));
  on_cpu->set_field(view(field));
  for_each_type([&](auto voxel) {
    using V = decltype(voxel);
    const auto source = label_map<V>(grid, random);
    const Options options{.interpolation = Interpolation::vote, .background = 5};
    const auto expected = run(*on_cpu, source, options);
    auto found = poisoned_outcome<V>(grid);
    for (const Region& part : {Region{{0, 0, 0}, {70, 41, 20}}, Region{{0, 0, 20}, {13, 41, 37}},
                               Region{{13, 0, 20}, {14, 41, 37}}, Region{{14, 0, 20}, {70, 41, 37}}}) {
      const Target target{.source = view(source),
                          .output = view(found.output),
                          .interpolation = options.interpolation,
                          .background = options.background};
      found.report += resampler->resample(part, {&target, 1}, maps_of(found));
    }
    expect_same_outcome(expected, found);
    expect_same_report(expected.report, found.report);
  });
}

}  // namespace
}  // namespace tetwarp
