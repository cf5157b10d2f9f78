// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `cpu`, from given medians, and what is written of them.
#include "bench/cpu/cpu_floors.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bench/cpu/cpu_report.h"
#include "tests/support/floors.h"
#include "tests/support/says.h"

namespace tetwarp::bench {
namespace {

using test::find_floor;

Summary ms(double median) { return {median, median, median, median, median, 3}; }
PeerTimes peer(double median) { return {ms(median), 0.25}; }

/// 10 ms of set_field, 30 of resample.
CpuRun make_run(const std::string& field, const glm::i64vec3& size = {512, 512, 300}) {
  CpuRun run;
  run.size = size;
  run.field = field;
  run.ours = {ms(10), ms(30), ms(40)};
  return run;
}

/// Expects a floor that also has an aim.
void expect_floor(const std::vector<Floor>& floors, const std::string& ratio, const std::string& where, double value,
                  std::optional<double> required, std::optional<double> aim, bool met) {
  test::expect_floor(floors, ratio, where, value, required, met);
  const Floor* floor = find_floor(floors, ratio, where);
  ASSERT_TRUE(floor);
  EXPECT_EQ(floor->aim, aim) << ratio << ", " << where;
}

TEST(CpuFloors, ThePaperCountsSetFieldAndItksWarpDoesNot) {
  CpuResults results;
  results.runs = {make_run("wave")};
  results.runs[0].paper = peer(236);
  results.runs[0].itk_warp = peer(36);
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "paper / new field", "wave", 5.9, 6, 20, false);
  expect_floor(floors, "ITK warp / resample", "wave", 1.2, 1, 3, true);
  EXPECT_EQ(floors.size(), 2u);
  EXPECT_FALSE(all_met(floors));
}

TEST(CpuFloors, AFurtherVolumeMayTakeAThirdOfTheFirstOrSoMuchAVoxel) {
  CpuResults results;
  results.runs = {make_run("wave", {1000, 1000, 10}), make_run("twist", {1000, 1000, 10}),
                  make_run("identity", {1000, 1000, 100})};
  results.runs[0].two_ms = ms(39);
  results.runs[1].two_ms = ms(46.5);
  results.runs[2].two_ms = ms(180);  // 1.5 ns a voxel
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "further volume / allowed", "wave", 9 / 15.0, 1, {}, true);
  expect_floor(floors, "further volume / allowed", "twist", 16.5 / 15, 1, {}, false);
  expect_floor(floors, "further volume / allowed", "identity", 1, 1, {}, true);
}

TEST(CpuFloors, SlowPeersAreHeldAgainstTheRunOnTheirOwnVolume) {
  CpuResults results;
  results.runs = {make_run("twist")};
  results.slow = {make_run("twist", {512, 512, 40})};
  results.slow[0].ours.new_field_ms = ms(5);
  results.slow[0].itk_invert_and_warp = peer(250);
  results.slow[0].vtk_probe = peer(99);
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "ITK invert and warp / new field", "twist, 40 slices", 50, 50, 200, true);
  expect_floor(floors, "VTK probe / new field", "twist, 40 slices", 19.8, 20, 60, false);
}

TEST(CpuFloors, InvertingIdentityIsNoWorkAndHasNoFloor) {
  CpuResults results;
  results.slow = {make_run("identity", {512, 512, 40})};
  results.slow[0].itk_invert_and_warp = peer(400);
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "ITK invert and warp / new field", "identity, 40 slices", 10, {}, {}, false);
  EXPECT_TRUE(all_met(floors));
}

TEST(CpuFloors, IdentityIsHeldAgainstTheBytesAndALocalFieldIsToldBesideThem) {
  CpuResults results;
  for (const std::string field : {"identity", "local", "wave"}) {
    results.runs.push_back(make_run(field));
    results.runs.back().bytes_ms = ms(16);
  }
  results.runs[1].resting = {0.25, ms(9)};
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "new field / bytes", "local, slices at rest", 2.25, 2, {}, false);
  expect_floor(floors, "new field / bytes", "identity", 2.5, 2, {}, false);
  expect_floor(floors, "resample / bytes", "identity", 1.875, 2, {}, true);
  expect_floor(floors, "new field / bytes", "local", 2.5, {}, {}, false);
  EXPECT_FALSE(find_floor(floors, "new field / bytes", "wave"));
}

TEST(CpuFloors, AVoxelOfALargeVolumeCostsAQuarterMoreAtMost) {
  CpuResults results;
  for (const glm::i64vec3& size : {glm::i64vec3(100), glm::i64vec3(200), glm::i64vec3(200, 200, 400)}) {
    results.growth.push_back(make_run("wave", size));
  }
  results.growth[1].ours.new_field_ms = ms(8 * 40 * 1.25);
  results.growth[2].ours.new_field_ms = ms(16 * 40 * 1.3);
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "new field, a voxel", "wave, 200 x 200 x 200 to 100 x 100 x 100", 1.25, 1.25, {}, true);
  expect_floor(floors, "new field, a voxel", "wave, 200 x 200 x 400 to 100 x 100 x 100", 1.3, 1.25, {}, false);
}

TEST(CpuFloors, EfficiencyIsTheTimeAloneOverTheTimeOfAllThreads) {
  CpuResults results;
  results.scaling = {"wave", 4, {ms(10), ms(30), ms(40)}, {ms(5), ms(15), ms(20)}};
  expect_floor(find_floors(results), "efficiency of threads, new field", "wave, 4 threads", 0.5, {}, {}, false);
}

TEST(CpuFloors, WhatWasNotMeasuredHasNoFloor) {
  CpuResults results;
  results.runs = {make_run("wave")};
  results.coarse = {make_run("wave")};
  EXPECT_TRUE(find_floors(results).empty());
}

CpuResults small_results() {
  CpuResults results;
  results.machine = {.cpu = "A CPU", .threads = 2};
  results.itk = "5.2.1";
  results.runs = {make_run("wave")};
  results.runs[0].paper = peer(200);
  results.runs[0].bytes_ms = ms(16);
  results.slow = {make_run("wave", {512, 512, 40})};
  results.slow[0].itk_invert_and_warp = peer(4000);
  results.growth = {make_run("wave")};
  results.left_out = {{512, 512, 600}};
  results.scaling = {"wave", 2, {ms(10), ms(30), ms(40)}, {ms(5), ms(20), ms(25)}};
  return results;
}

TEST(CpuReport, JsonHasEveryNumber) {
  const CpuResults results = small_results();
  const std::vector<Floor> floors = find_floors(results);
  const nlohmann::json document = to_json(results, floors);
  const nlohmann::json& run = document["runs"][0];
  EXPECT_EQ(run["new_field_ms"]["median"], 40.0);
  EXPECT_NEAR(run["new_field_ns_a_voxel"].get<double>(), 40e6 / (512 * 512 * 300), 1e-12);
  EXPECT_EQ(run["paper"]["ms"]["median"], 200.0);
  EXPECT_EQ(run["paper"]["differing"], 0.25);
  EXPECT_TRUE(run["itk_warp"].is_null());
  EXPECT_EQ(document["slow_peers"][0]["size"], (nlohmann::json{512, 512, 40}));
  EXPECT_EQ(document["growth_left_out"], (nlohmann::json{{512, 512, 600}}));
  EXPECT_EQ(document["scaling"]["efficiency"], 0.8);
  EXPECT_EQ(document["itk"], "5.2.1");
  EXPECT_TRUE(document["vtk"].is_null());
  ASSERT_EQ(document["floors"].size(), floors.size());
  EXPECT_EQ(document["floors"][0]["required"], (nlohmann::json{{"limit", 6.0}, {"met", false}}));
}

TEST(CpuReport, MarkdownHasTheTablesAndSaysWhatIsLeftOut) {
  const CpuResults results = small_results();
  const std::string text = to_markdown(results, find_floors(results));
  EXPECT_TRUE(
      says(text, {"A CPU, 2 threads", "ITK 5.2.1", "VTK not in this build, left out", "## A vertex on every",
                  "| 5.00 | - | 2.50 | 1.88 | 25.000 % | - |", "| 512 x 512 x 40 | ITK invert and warp | 4000 |",
                  "Left out, 512 x 512 x 600", "Efficiency of a new field: 0.80",
                  "| paper / new field | wave | 5.000 | at least 6 | missed | at least 20 | not reached |"}));
  EXPECT_FALSE(says(text, {"## Larger cells"}));
}

}  // namespace
}  // namespace tetwarp::bench
