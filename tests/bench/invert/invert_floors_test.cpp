// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `invert`, from given times and errors, and what is written of them.
#include "bench/invert/invert_floors.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bench/invert/invert_report.h"
#include "tests/support/floors.h"
#include "tests/support/says.h"

namespace tetwarp::bench {
namespace {

using test::find_floor;

Summary ms(double median) { return {median, median, median, median, median, 3}; }

InverseRun make_run(const std::string& field, const std::string& by, double median, double mean, double largest) {
  return {
      .field = field,
      .by = by,
      .ms = ms(median),
      .cpu_ms = ms(2 * median),
      .accuracy = {
          .with_source = 1000, .mean = mean, .percentile_99 = 0.5 * largest, .largest = largest, .without_source = 70}};
}

InvertResults results_of(const std::vector<InverseRun>& runs) {
  InvertResults results;
  results.machine = {.cpu = "A CPU", .threads = 2};
  results.itk = "5.2.1";
  results.runs = runs;
  return results;
}

void expect_floor(const std::vector<Floor>& floors, const std::string& ratio, const std::string& where, double value,
                  std::optional<double> required, bool met) {
  test::expect_floor(floors, ratio, where, value, required, met, 1e-9);
}

TEST(InvertFloors, EachInverterIsHeldAgainstTetwarpOnItsOwnField) {
  const std::vector<Floor> floors =
      find_floors(results_of({make_run("wave", "tetwarp", 100, 0.1, 0.4), make_run("wave", "ITK a", 5000, 0.2, 0.3),
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
  InvertResults results = results_of({make_run("wave", "tetwarp", 100, 0.1, 0.4)});
  EXPECT_TRUE(all_met(find_floors(results)));
  results.runs[0].accuracy.written = 1;
  expect_floor(find_floors(results), "written without a source", "wave", 1, 0, false);
  results.runs[0].accuracy.written = 0;
  results.runs[0].accuracy.left_out = 1;
  expect_floor(find_floors(results), "left out with a source", "wave", 1, 0, false);
  EXPECT_FALSE(all_met(find_floors(results)));
}

TEST(InvertFloors, WhatItkWritesWithoutASourceIsToldAndNoFloorOfOurs) {
  InvertResults results =
      results_of({make_run("wave", "tetwarp", 1, 0.1, 0.4), make_run("wave", "ITK a", 100, 0.2, 0.8)});
  results.runs[1].accuracy.written = 70;
  EXPECT_TRUE(all_met(find_floors(results)));
}

TEST(InvertFloors, AFieldThatFoldsHasNoErrorsAndItsTimeIsNotHeldAgainstAnything) {
  const std::vector<Floor> floors =
      find_floors(results_of({make_run("folds", "tetwarp", 100, NAN, NAN), make_run("folds", "ITK a", 300, NAN, NAN)}));
  expect_floor(floors, "time / tetwarp's", "folds, ITK a", 3, {}, false);
  expect_floor(floors, "written without a source", "folds", 0, 0, true);
  EXPECT_FALSE(find_floor(floors, "mean error / tetwarp's", "folds, ITK a"));
  EXPECT_TRUE(all_met(floors));
}

TEST(InvertFloors, WithoutTetwarpsRunThereIsNoRatio) {
  EXPECT_TRUE(find_floors(results_of({make_run("wave", "ITK a", 100, 0.2, 0.8)})).empty());
}

TEST(InvertReport, JsonHasEveryNumber) {
  InvertResults results =
      results_of({make_run("wave", "tetwarp", 100, 0.25, 0.5), make_run("folds", "tetwarp", 100, NAN, NAN)});
  Accuracy& found = results.runs[0].accuracy;
  found.left_out = 3;
  found.written = 60;
  found.zero = 20;
  found.pointing_in = 30;
  const std::vector<Floor> floors = find_floors(results);
  const nlohmann::json document = to_json(results, floors), &run = document["runs"][0];
  EXPECT_EQ(document["program"], "tetwarp-bench invert");
  EXPECT_EQ(document["itk"], "5.2.1");
  EXPECT_EQ(document["options"]["width"], 256);
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
  EXPECT_TRUE(document["runs"][1]["mean_error"].is_null());
  EXPECT_EQ(document["floors"].size(), floors.size());
}

TEST(InvertReport, MarkdownHasTheTablesAndSaysWhatIsLeftOut) {
  InvertResults results =
      results_of({make_run("wave", "tetwarp", 100, 0.0001, 0.004), make_run("wave", "ITK a", 4900, 0.2, 8),
                  make_run("folds", "tetwarp", 1, NAN, NAN)});
  results.runs[1].accuracy.written = 70;
  results.runs[1].accuracy.zero = 20;
  results.runs[1].accuracy.pointing_in = 40;
  EXPECT_TRUE(says(to_markdown(results, find_floors(results)),
                   {"# tetwarp-bench invert", "A CPU, 2 threads", "ITK 5.2.1", "256 x 256 x 150",
                    "| wave | tetwarp | 100.0 (100.0-100.0) | 200.0 (200.0-200.0) | 0.0001 | 0.002 | 0.004 |",
                    "| folds | tetwarp | 1.000 (1.000-1.000) | 2.000 (2.000-2.000) | - | - | - |",
                    "| wave | ITK a | 1000 | 0 | 70 | 70 | 20 | 40 |",
                    "| time / tetwarp's | wave, ITK a | 49.000 | at least 50 | missed |"}));
  results.itk = {};
  EXPECT_TRUE(says(to_markdown(results, {}), {"ITK not in this build, left out"}));
}

}  // namespace
}  // namespace tetwarp::bench
