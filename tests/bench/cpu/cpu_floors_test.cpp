// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `cpu`, from given medians.
#include "bench/cpu/cpu.h"

#include <gtest/gtest.h>

#include "tests/support/floors.h"

namespace tetwarp::bench {
namespace {

using test::find_floor;
using test::steady_ms;

Json peer(double median) { return {{"ms", steady_ms(median)}, {"differing", 0.25}}; }

/// 10 ms of set_field, 30 of resample, unless told otherwise.
Json make_run(const std::string& field, const glm::i64vec3& size = {512, 512, 300}, double new_field = 40) {
  return {{"size", size_json(size)},
          {"field", field},
          {"set_field_ms", steady_ms(10)},
          {"resample_ms", steady_ms(30)},
          {"new_field_ms", steady_ms(new_field)},
          {"new_field_ns_a_voxel", 1e6 * new_field / static_cast<double>(size.x * size.y * size.z)}};
}

/// Expects a floor that also has an aim.
void expect_floor(const Floors& floors, const std::string& ratio, const std::string& where, double value,
                  std::optional<double> required, std::optional<double> aim, bool met) {
  test::expect_floor(floors, ratio, where, value, required, met);
  const Floor* floor = find_floor(floors, ratio, where);
  ASSERT_TRUE(floor);
  EXPECT_EQ(floor->aim, aim) << ratio << ", " << where;
}

TEST(CpuFloors, ThePaperCountsSetFieldAndItksWarpDoesNot) {
  Json results;
  results["runs"] = Json::array({make_run("wave")});
  results["runs"][0]["paper"] = peer(236);
  results["runs"][0]["itk_warp"] = peer(36);
  const Floors floors = find_cpu_floors(results);
  expect_floor(floors, "paper / new field", "wave", 5.9, 6, 20, false);
  expect_floor(floors, "ITK warp / resample", "wave", 1.2, 1, 3, true);
  EXPECT_EQ(floors.size(), 2u);
  EXPECT_FALSE(all_met(floors));
}

TEST(CpuFloors, AFurtherVolumeMayTakeAThirdOfTheFirstOrSoMuchAVoxel) {
  Json results;
  results["runs"] = Json::array({make_run("wave", {1000, 1000, 10}), make_run("twist", {1000, 1000, 10}),
                                 make_run("identity", {1000, 1000, 100})});
  results["runs"][0]["two_volumes_ms"] = steady_ms(39);
  results["runs"][1]["two_volumes_ms"] = steady_ms(46.5);
  results["runs"][2]["two_volumes_ms"] = steady_ms(180);  // 1.5 ns a voxel
  const Floors floors = find_cpu_floors(results);
  expect_floor(floors, "further volume / allowed", "wave", 9 / 15.0, 1, {}, true);
  expect_floor(floors, "further volume / allowed", "twist", 16.5 / 15, 1, {}, false);
  expect_floor(floors, "further volume / allowed", "identity", 1, 1, {}, true);
}

TEST(CpuFloors, SlowPeersAreHeldAgainstTheRunOnTheirOwnVolume) {
  Json results;
  results["runs"] = Json::array({make_run("twist")});
  results["slow_peers"] = Json::array({make_run("twist", {512, 512, 40})});
  results["slow_peers"][0]["new_field_ms"] = steady_ms(5);
  results["slow_peers"][0]["itk_invert_and_warp"] = peer(250);
  results["slow_peers"][0]["vtk_probe"] = peer(99);
  const Floors floors = find_cpu_floors(results);
  expect_floor(floors, "ITK invert and warp / new field", "twist, 40 slices", 50, 50, 200, true);
  expect_floor(floors, "VTK probe / new field", "twist, 40 slices", 19.8, 20, 60, false);
}

TEST(CpuFloors, InvertingIdentityIsNoWorkAndHasNoFloor) {
  Json results;
  results["slow_peers"] = Json::array({make_run("identity", {512, 512, 40})});
  results["slow_peers"][0]["itk_invert_and_warp"] = peer(400);
  const Floors floors = find_cpu_floors(results);
  expect_floor(floors, "ITK invert and warp / new field", "identity, 40 slices", 10, {}, {}, false);
  EXPECT_TRUE(all_met(floors));
}

TEST(CpuFloors, IdentityIsHeldAgainstTheBytesAndALocalFieldIsToldBesideThem) {
  Json results;
  for (const std::string field : {"identity", "local", "wave"}) {
    results["runs"].push_back(make_run(field));
    results["runs"].back()["bytes_ms"] = steady_ms(16);
  }
  results["runs"][1]["resting"] = {{"share", 0.25}, {"new_field_ms", steady_ms(9)}};
  const Floors floors = find_cpu_floors(results);
  expect_floor(floors, "new field / bytes", "local, slices at rest", 2.25, 2, {}, false);
  expect_floor(floors, "new field / bytes", "identity", 2.5, 2, {}, false);
  expect_floor(floors, "resample / bytes", "identity", 1.875, 2, {}, true);
  expect_floor(floors, "new field / bytes", "local", 2.5, {}, {}, false);
  EXPECT_FALSE(find_floor(floors, "new field / bytes", "wave"));
}

TEST(CpuFloors, AVoxelOfALargeVolumeCostsAQuarterMoreAtMost) {
  Json results;
  results["growth"] =
      Json::array({make_run("wave", glm::i64vec3(100)), make_run("wave", glm::i64vec3(200), 8 * 40 * 1.25),
                   make_run("wave", {200, 200, 400}, 16 * 40 * 1.3)});
  const Floors floors = find_cpu_floors(results);
  expect_floor(floors, "new field, a voxel", "wave, 200 x 200 x 200 to 100 x 100 x 100", 1.25, 1.25, {}, true);
  expect_floor(floors, "new field, a voxel", "wave, 200 x 200 x 400 to 100 x 100 x 100", 1.3, 1.25, {}, false);
}

TEST(CpuFloors, EfficiencyIsToldAndHeldAgainstNothing) {
  Json results;
  results["scaling"] = {{"field", "wave"}, {"threads", 4}, {"efficiency", 0.5}};
  expect_floor(find_cpu_floors(results), "efficiency of threads, new field", "wave, 4 threads", 0.5, {}, {}, false);
}

TEST(CpuFloors, WhatWasNotMeasuredHasNoFloor) {
  Json results;
  results["runs"] = Json::array({make_run("wave")});
  results["larger_cells"] = Json::array({make_run("wave")});
  EXPECT_TRUE(find_cpu_floors(results).empty());
}

TEST(CpuFloors, WhatCameOfThemIsWritten) {
  Json results;
  results["runs"] = Json::array({make_run("wave")});
  results["runs"][0]["paper"] = peer(200);
  const Json written = to_json(find_cpu_floors(results));
  ASSERT_EQ(written.size(), 1u);
  EXPECT_EQ(written[0]["value"], 5);
  EXPECT_EQ(written[0]["required"], (Json{{"limit", 6.0}, {"met", false}}));
  EXPECT_EQ(written[0]["aim"], (Json{{"limit", 20.0}, {"met", false}}));
}

}  // namespace
}  // namespace tetwarp::bench
