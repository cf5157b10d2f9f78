// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/core/ray_cast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "deform/phantom.h"
#include "deform/render/ray_frame.h"
#include "tests/support/fields.h"
#include "tests/support/instruction_set.h"

namespace tetwarp {
namespace {

using ray::Known;
using test::Random;
using test::seed_text;
using test::test_seed;
using test::unit_grid;

/// A transfer function and what rays look up in it.
struct LookUp {
  explicit LookUp(const TransferFunction& transfer)
      : table(transfer_table(transfer, 0.5)), integrals(transfer_integrals(table, 0.5)) {
    frame = ray_frame(grid, {.transfer = transfer}, view_plane({}, grid));
    tables.integrals = integrals.before.data();
    tables.lowest_entry = integrals.lowest;
    tables.highest_entry = integrals.highest;
    tables.clear = clear_values(table, frame);
  }

  Known kind(float value) const { return ray::kind_of(tables.clear, value); }
  /// The optical depth of all entries between two values.
  float depth(float one, float other) const {
    const auto [low, high] = std::minmax(one, other);
    return ray::sum_over(tables, endless_entry(frame, low), endless_entry(frame, high)).depth;
  }

  Geometry grid = unit_grid({8, 8, 8});
  std::vector<TransferEntry> table;
  TransferIntegrals integrals;
  RayFrame frame;
  RayTables tables;
};

/// Points at random, many of them clear.
TransferFunction some_function(Random& random) {
  TransferFunction transfer{.name = "some", .points = {}};
  double value = random.real(-1000, 1000);
  const auto points = random.integer(2, 7);
  for (int n = 0; n < points; ++n) {
    transfer.points.push_back({value, glm::dvec3(1), random.integer(0, 2) == 0 ? random.real(0, 1) : 0.0});
    value += std::exp2(random.real(-6, 10));
  }
  return transfer;
}

TEST(RayCast, WhatIsCalledClearHasNoDepth) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  int below = 0, between = 0;
  for (std::uint64_t number = 0; number < 200; ++number) {
    Random random(seed, number);
    const TransferFunction transfer = some_function(random);
    const LookUp look_up(transfer);
    std::vector<float> values = {look_up.tables.clear.below, look_up.tables.clear.from, look_up.tables.clear.to, -3e38f,
                                 3e38f};
    for (const TransferPoint& point : transfer.points) values.push_back(static_cast<float>(point.value));
    for (std::size_t n = values.size(); n-- > 0;) {  // and their neighbours
      values.push_back(std::nextafter(values[n], std::numeric_limits<float>::infinity()));
      values.push_back(std::nextafter(values[n], -std::numeric_limits<float>::infinity()));
    }
    for (int n = 0; n < 40; ++n)
      values.push_back(
          static_cast<float>(random.real(transfer.points.front().value - 10, transfer.points.back().value + 10)));
    for (const float one : values) {
      for (const float other : values) {
        const Known kind = look_up.kind(one);
        if (kind == Known::seen || kind != look_up.kind(other)) continue;
        ASSERT_EQ(look_up.depth(one, other), 0) << "function " << number << ", " << one << " to " << other;
        ++(kind == Known::below ? below : between);
      }
    }
  }
  EXPECT_GT(below, 1000);
  EXPECT_GT(between, 1000);
}

TEST(RayCast, TheGapOfLungIsTheSoftTissue) {
  const LookUp lung(transfer_function("ct-lung")), bone(transfer_function("ct-bone"));
  EXPECT_EQ(lung.kind(-1000), Known::below);
  EXPECT_EQ(lung.kind(-800), Known::seen);
  EXPECT_EQ(lung.kind(40), Known::between);
  EXPECT_EQ(lung.kind(400), Known::seen);
  EXPECT_GT(lung.depth(-1000, 40), 0) << "from one kind to another something lies between";
  EXPECT_EQ(bone.kind(160), Known::below);
  EXPECT_EQ(bone.kind(2000), Known::seen);
  EXPECT_EQ(bone.kind(std::numeric_limits<float>::quiet_NaN()), Known::seen) << "it is looked at closely";
}

TEST(RayCast, SumsOverEntriesAreThoseOfAllOneByOne) {
  const LookUp lung(transfer_function("ct-lung")), skin(transfer_function("ct-skin"));
  for (const LookUp* const of : {&lung, &skin}) {
    for (const auto& [low, high] : {std::pair{-50, -20}, {-30, 700}, {0, 4095}, {3000, 5000}, {4096, 4200}, {5, 5}}) {
      double depth = 0, red = 0;
      for (int entry = low; entry <= high; ++entry) {
        const TransferEntry& e = of->table[static_cast<std::size_t>(std::clamp(entry, 0, kTransferEntries - 1))];
        const double part = -std::log1p(-double{e.opacity}) * 0.5;
        depth += part;
        red += part * double{e.red};
      }
      const TransferIntegral sum = ray::sum_over(of->tables, low, high);
      EXPECT_NEAR(sum.depth, depth, 1e-5 + 1e-5 * depth) << low << " to " << high;
      EXPECT_NEAR(sum.red, red, 1e-5 + 1e-5 * red) << low << " to " << high;
    }
  }
}

TEST(RayCast, InverseRootIsThatOfTheLibraryTo5e6) {
  Random random(test_seed());
  for (int n = 0; n < 100000; ++n) {
    const auto x = static_cast<float>(std::exp2(random.real(-120, 120)));
    ASSERT_NEAR(double{ray::inverse_root(x)} * std::sqrt(double{x}), 1, 5e-6) << x;
  }
}

/// With an instruction for a fused multiply-add and without.
TEST(RayCast, PicturesHaveTheSameBytesOnEveryInstructionSet) {
  const Volume<std::int16_t> body = make_phantom({96, 80, 40}, {3.5, 3.5, 6}, 7);
  const ViewPlane plane = view_plane({.angle_deg = 33, .elevation_deg = 12, .width = 120, .height = 90}, body.geometry);
  for (const std::string& name : transfer_function_names()) {
    std::vector<std::uint8_t> first;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      const test::OnInstructionSet on(target);
      const auto renderer = make_cpu_renderer();
      renderer->set_volume(view(body));
      renderer->set_style({.transfer = transfer_function(name)});
      std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(plane.width * plane.height));
      renderer->render(plane, rgb);
      if (first.empty()) first = rgb;
      EXPECT_GT(*std::max_element(rgb.begin(), rgb.end()), 60) << name;
      ASSERT_EQ(rgb, first) << name;
    }
  }
}

}  // namespace
}  // namespace tetwarp
