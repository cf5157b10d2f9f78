// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `gpu`, from given medians.
#include "bench/gpu/gpu.h"

#include <gtest/gtest.h>

#include "tests/support/floors.h"

namespace tetwarp::bench {
namespace {

using test::expect_floor;
using test::find_floor;
using test::steady_ms;

Json make_run(const std::string& field, double set_field, double resample, std::optional<double> paper = {},
              std::int64_t cell_size = 1, std::int64_t slices = 300) {
  Json run{{"size", {512, 512, slices}},
           {"field", field},
           {"cell_size", cell_size},
           {"set_field_ms", steady_ms(set_field)},
           {"resample_ms", steady_ms(resample)},
           {"new_field_ms", steady_ms(set_field + resample)},
           {"two_volumes_ms", steady_ms(resample + 0.25)}};
  if (paper) run["paper_ms"] = steady_ms(*paper);
  return run;
}

/// A volume copied in 0.1 ms and a field in 0.4: floors of 0.1 and 0.3.
Json results_of(const std::vector<Json>& runs) {
  return {
      {"size", {512, 512, 300}}, {"copies", copies_json({{"volume_ms", {0.1}}, {"field_ms", {0.4}}})}, {"runs", runs}};
}

TEST(GpuFloors, BytesAreTheVolumesCopyAndHalfTheFields) {
  const Json copies = copies_json({{"volume_ms", {0.1}}, {"field_ms", {0.4}}});
  EXPECT_DOUBLE_EQ(*number(copies, "/volume_floor_ms"), 0.1);
  EXPECT_DOUBLE_EQ(*number(copies, "/bytes_floor_ms"), 0.3);
}

TEST(GpuFloors, ResampleAndNewFieldHaveEachTheirRatioToThePaper) {
  for (const std::string field : {"identity", "wave", "twist", "bubble", "elastic"}) {
    Json run = make_run(field, 1.0, 1.5, 9.6);
    run["backward_ms"] = steady_ms(1.2);
    const Floors floors = find_gpu_floors(results_of({run}));
    expect_floor(floors, "paper / resample", field, 6.4, 6, true);
    expect_floor(floors, "paper / new field", field, 3.84, 4, false);
    expect_floor(floors, "backward / resample", field, 0.8, {}, {});
    expect_floor(floors, "resample / bytes", field, 5, {}, {});
    EXPECT_FALSE(all_met(floors));
  }
}

TEST(GpuFloors, AFurtherVolumeIsWhatTwoTakeMoreThanOne) {
  Floors floors = find_gpu_floors(results_of({make_run("wave", 0.3, 0.7)}));
  expect_floor(floors, "further volume / new field", "wave", 0.25, 1.0 / 3, true);
  floors = find_gpu_floors(results_of({make_run("elastic", 0.3, 0.2)}));
  expect_floor(floors, "further volume / new field", "elastic", 0.5, 1.0 / 3, false);
}

TEST(GpuFloors, AnAimThatIsNotReachedIsNoFailure) {
  Json run = make_run("wave", 1.0, 1.0, 12);
  run["backward_ms"] = steady_ms(0.5);
  const Floors floors = find_gpu_floors(results_of({run}));
  EXPECT_FALSE(find_floor(floors, "backward / resample", "wave")->meets(1));
  EXPECT_FALSE(find_floor(floors, "paper / resample", "wave")->meets(15));
  EXPECT_TRUE(all_met(floors));
}

TEST(GpuFloors, HardFieldsAreNoSlowerThanThePaperWithSetFieldCounted) {
  const Floors floors = find_gpu_floors(results_of({make_run("noise", 1.5, 9, 10), make_run("folds", 1, 9, 10)}));
  expect_floor(floors, "paper / new field", "noise", 10 / 10.5, 1, false);
  expect_floor(floors, "paper / new field", "folds", 1, 1, true);
  EXPECT_EQ(floors.size(), 2u);
}

TEST(GpuFloors, LargerCellsAreHeldAgainstTheCopyAndTheLargestAgainstGascon) {
  Json small = make_run("wave", 0.1, 0.5, 3, 4), large = make_run("wave", 0.1, 0.51, 3, 16);
  small["gascon_ms"] = steady_ms(20);
  large["gascon_ms"] = steady_ms(0.5);
  const Floors floors = find_gpu_floors(results_of({small, large}));
  expect_floor(floors, "new field / copy", "wave, cells of 4", 6, 6, true);
  expect_floor(floors, "new field / copy", "wave, cells of 16", 6.1, 6, false);
  expect_floor(floors, "gascon / new field", "wave, cells of 16", 0.5 / 0.61, 1, false);
  EXPECT_FALSE(find_floor(floors, "gascon / new field", "wave, cells of 4"));
}

TEST(GpuFloors, TwiceTheSlicesMayCostFivePercentMoreThanTwice) {
  const Floors floors = find_gpu_floors(results_of(
      {make_run("wave", 1, 1), make_run("wave", 2.3, 2.05, {}, 1, 600), make_run("wave", 1, 1, {}, 1, 1200)}));
  expect_floor(floors, "resample, slices", "wave, 600 / 300", 2.05, 2.1, true);
  expect_floor(floors, "new field, slices", "wave, 600 / 300", 2.175, 2.1, false);
  expect_floor(floors, "resample, slices", "wave, 1200 / 300", 1, 4.2, true);
}

TEST(GpuFloors, LocalIsTwiceAsFastAsTheFastestGlobalFieldOrCloseToTheBytes) {
  const std::vector<Json> global{make_run("wave", 1, 1.2), make_run("elastic", 1, 1.6)};
  const auto with_local = [&](double resample) {
    std::vector<Json> runs = global;
    runs.push_back(make_run("local", 1, resample));
    return find_gpu_floors(results_of(runs));
  };
  expect_floor(with_local(0.6), "wave / local, resample", "local", 2, 2, true);
  expect_floor(with_local(0.8), "wave / local, resample", "local", 1.5, 2, false);
  expect_floor(with_local(0.45), "resample / bytes", "local", 1.5, 1.5, true);
  expect_floor(find_gpu_floors(results_of({make_run("local", 1, 0.6)})), "resample / bytes", "local", 2, 1.5, false);
}

TEST(GpuFloors, MemoryMayBeATenthOr128MegabytesMoreThanTheData) {
  EXPECT_EQ(MemoryUse{.data = 2'000'000'000}.allowed(), 2'200'000'000u);
  EXPECT_EQ(MemoryUse{.data = 1000}.allowed(), 128'001'000u);
  Json results = results_of({});
  results["memory"] = Json::array(
      {memory_json("wave", {.data = 872'000'000, .host_views = 900'000'000, .device_views = 1'200'000'000})});
  const Floors floors = find_gpu_floors(results);
  expect_floor(floors, "memory / allowed", "wave, host views", 0.9, 1, true);
  expect_floor(floors, "memory / allowed", "wave, device views", 1.2, 1, false);
}

TEST(GpuFloors, MeshesAreNoSlowerThanGascon) {
  Json results = results_of({});
  const auto mesh = [](std::int64_t cell_size, double resample, double gascon) {
    return Json{{"field", "wave"},
                {"cell_size", cell_size},
                {"resample_ms", steady_ms(resample)},
                {"gascon_ms", steady_ms(gascon)}};
  };
  results["meshes"] = {mesh(16, 1, 2.5), mesh(32, 2, 1.9)};
  const Floors floors = find_gpu_floors(results);
  expect_floor(floors, "gascon / mesh resample", "wave, cells of 16", 2.5, 1, true);
  expect_floor(floors, "gascon / mesh resample", "wave, cells of 32", 0.95, 1, false);
}

TEST(GpuFloors, WhatWasNotRunHasNoFloor) {
  EXPECT_TRUE(find_gpu_floors(results_of({})).empty());
  EXPECT_TRUE(find_gpu_floors(results_of({make_run("wave", 1, 1, {}, 1, 600)})).empty());
}

}  // namespace
}  // namespace tetwarp::bench
