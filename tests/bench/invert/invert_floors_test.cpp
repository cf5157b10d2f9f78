// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `invert`, from given times and errors, and what is written of them.
#include "bench/invert/invert.h"

#include <gtest/gtest.h>

#include "tests/support/floors.h"

namespace tetwarp::bench {
namespace {

using test::find_floor;

Json make_run(const std::string& field, const std::string& by, double median, double mean, double largest) {
  return inverse_json(
      field, by, {{"ms", {median}}, {"cpu_ms", {2 * median}}},
      {.with_source = 1000, .mean = mean, .percentile_99 = 0.5 * largest, .largest = largest, .without_source = 70});
}

Json results_of(const std::vector<Json>& runs) { return {{"runs", runs}}; }

void expect_floor(const Floors& floors, const std::string& ratio, const std::string& where, double value,
                  std::optional<double> required, bool met) {
  test::expect_floor(floors, ratio, where, value, required, met, 1e-9);
}

TEST(InvertFloors, EachInverterIsHeldAgainstTetwarpOnItsOwnField) {
  const Floors floors = find_invert_floors(
      results_of({make_run("wave", "tetwarp", 100, 0.1, 0.4), make_run("wave", "ITK a", 5000, 0.2, 0.3),
                  make_run("twist", "tetwarp", 10, 0.1, 0.2), make_run("twist", "ITK a", 490, 0.05, 0.8)}));
  expect_floor(floors, "time / tetwarp's", "wave, ITK a", 50, 50, true);
  expect_floor(floors, "mean error / tetwarp's", "wave, ITK a", 2, 1, true);
  expect_floor(floors, "largest error / tetwarp's", "wave, ITK a", 0.75, 1, false);
  expect_floor(floors, "time / tetwarp's", "twist, ITK a", 49, 50, false);
  expect_floor(floors, "mean error / tetwarp's", "twist, ITK a", 0.5, 1, false);
  expect_floor(floors, "largest error / tetwarp's", "twist, ITK a", 4, 1, true);
  EXPECT_EQ(floors.size(), 2u * (3 + 2));
}

TEST(InvertFloors, OneVectorWithoutASourceOrOneLeftOutIsAMiss) {
  Json results = results_of({make_run("wave", "tetwarp", 100, 0.1, 0.4)});
  EXPECT_TRUE(all_met(find_invert_floors(results)));
  results["runs"][0]["written_without_source"] = 1;
  expect_floor(find_invert_floors(results), "written without a source", "wave", 1, 0, false);
  results["runs"][0]["written_without_source"] = 0;
  results["runs"][0]["left_out"] = 1;
  expect_floor(find_invert_floors(results), "left out with a source", "wave", 1, 0, false);
  EXPECT_FALSE(all_met(find_invert_floors(results)));
}

TEST(InvertFloors, WhatItkWritesWithoutASourceIsToldAndNoFloorOfOurs) {
  Json results = results_of({make_run("wave", "tetwarp", 1, 0.1, 0.4), make_run("wave", "ITK a", 100, 0.2, 0.8)});
  results["runs"][1]["written_without_source"] = 70;
  EXPECT_TRUE(all_met(find_invert_floors(results)));
}

TEST(InvertFloors, AFieldThatFoldsHasNoErrorsAndItsTimeIsNotHeldAgainstAnything) {
  const Floors floors = find_invert_floors(
      results_of({make_run("folds", "tetwarp", 100, NAN, NAN), make_run("folds", "ITK a", 300, NAN, NAN)}));
  expect_floor(floors, "time / tetwarp's", "folds, ITK a", 3, {}, false);
  expect_floor(floors, "written without a source", "folds", 0, 0, true);
  EXPECT_FALSE(find_floor(floors, "mean error / tetwarp's", "folds, ITK a"));
  EXPECT_TRUE(all_met(floors));
}

TEST(InvertFloors, WithoutTetwarpsRunThereIsNoRatio) {
  EXPECT_TRUE(find_invert_floors(results_of({make_run("wave", "ITK a", 100, 0.2, 0.8)})).empty());
}

TEST(InvertReport, ARowHasEveryNumber) {
  const Json run = inverse_json("wave", "tetwarp", {{"ms", {100}}, {"cpu_ms", {200}}},
                                {.with_source = 1000,
                                 .left_out = 3,
                                 .mean = 0.25,
                                 .percentile_99 = 0.25,
                                 .largest = 0.5,
                                 .without_source = 70,
                                 .written = 60,
                                 .zero = 20,
                                 .pointing_in = 30});
  EXPECT_EQ(run["field"], "wave");
  EXPECT_EQ(run["by"], "tetwarp");
  EXPECT_EQ(run["ms"]["median"], 100.0);
  EXPECT_EQ(run["cpu_ms"]["median"], 200.0);
  EXPECT_EQ(run["mean_error"], 0.25);
  EXPECT_EQ(run["percentile_99_error"], 0.25);
  EXPECT_EQ(run["largest_error"], 0.5);
  EXPECT_EQ(run["with_source"], 1000);
  EXPECT_EQ(run["left_out"], 3);
  EXPECT_EQ(run["without_source"], 70);
  EXPECT_EQ(run["written_without_source"], 60);
  EXPECT_EQ(run["zero_without_source"], 20);
  EXPECT_EQ(run["pointing_in_without_source"], 30);
  EXPECT_TRUE(make_run("folds", "tetwarp", 100, NAN, NAN)["mean_error"].is_null());
}

}  // namespace
}  // namespace tetwarp::bench
