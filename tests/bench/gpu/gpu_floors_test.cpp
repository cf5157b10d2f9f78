// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `gpu`, from given medians, and what is written of them.
#include "bench/gpu/gpu_floors.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bench/gpu/gpu_report.h"
#include "tests/support/floors.h"
#include "tests/support/says.h"

namespace tetwarp::bench {
namespace {

using test::expect_floor;
using test::find_floor;

Summary ms(double median) { return {median, median, median, median, median, 15}; }

GpuRun make_run(const std::string& field, double set_field, double resample, std::optional<double> paper = {},
                std::int64_t cell_size = 1, std::int64_t slices = 300) {
  GpuRun run;
  run.size = {512, 512, slices};
  run.field = field;
  run.cell_size = cell_size;
  run.set_field_ms = ms(set_field);
  run.resample_ms = ms(resample);
  run.new_field_ms = ms(set_field + resample);
  run.two_ms = ms(resample + 0.25);
  if (paper) run.paper_ms = ms(*paper);
  return run;
}

/// A volume copied in 0.1 ms and a field in 0.4: floors of 0.1 and 0.3.
GpuResults results_of(const std::vector<GpuRun>& runs) {
  GpuResults results;
  results.size = {512, 512, 300};
  results.copies = {ms(0.1), ms(0.4)};
  results.runs = runs;
  return results;
}

TEST(GpuFloors, BytesAreTheVolumesCopyAndHalfTheFields) {
  const CopyTimes copies{ms(0.1), ms(0.4)};
  EXPECT_DOUBLE_EQ(copies.volume_floor_ms(), 0.1);
  EXPECT_DOUBLE_EQ(copies.bytes_floor_ms(), 0.3);
}

TEST(GpuFloors, ResampleAndNewFieldHaveEachTheirRatioToThePaper) {
  for (const std::string field : {"identity", "wave", "twist", "bubble", "elastic"}) {
    GpuRun run = make_run(field, 1.0, 1.5, 9.6);
    run.backward_ms = ms(1.2);
    const std::vector<Floor> floors = find_floors(results_of({run}));
    expect_floor(floors, "paper / resample", field, 6.4, 6, true);
    expect_floor(floors, "paper / new field", field, 3.84, 4, false);
    expect_floor(floors, "backward / resample", field, 0.8, {}, {});
    expect_floor(floors, "resample / bytes", field, 5, {}, {});
    EXPECT_FALSE(all_met(floors));
  }
}

TEST(GpuFloors, AFurtherVolumeIsWhatTwoTakeMoreThanOne) {
  std::vector<Floor> floors = find_floors(results_of({make_run("wave", 0.3, 0.7)}));
  expect_floor(floors, "further volume / new field", "wave", 0.25, 1.0 / 3, true);
  floors = find_floors(results_of({make_run("elastic", 0.3, 0.2)}));
  expect_floor(floors, "further volume / new field", "elastic", 0.5, 1.0 / 3, false);
}

TEST(GpuFloors, AnAimThatIsNotReachedIsNoFailure) {
  GpuRun run = make_run("wave", 1.0, 1.0, 12);
  run.backward_ms = ms(0.5);
  const std::vector<Floor> floors = find_floors(results_of({run}));
  EXPECT_FALSE(find_floor(floors, "backward / resample", "wave")->meets(1));
  EXPECT_FALSE(find_floor(floors, "paper / resample", "wave")->meets(15));
  EXPECT_TRUE(all_met(floors));
}

TEST(GpuFloors, HardFieldsAreNoSlowerThanThePaperWithSetFieldCounted) {
  const std::vector<Floor> floors =
      find_floors(results_of({make_run("noise", 1.5, 9, 10), make_run("folds", 1, 9, 10)}));
  expect_floor(floors, "paper / new field", "noise", 10 / 10.5, 1, false);
  expect_floor(floors, "paper / new field", "folds", 1, 1, true);
  EXPECT_EQ(floors.size(), 2u);
}

TEST(GpuFloors, LargerCellsAreHeldAgainstTheCopyAndTheLargestAgainstGascon) {
  GpuRun small = make_run("wave", 0.1, 0.5, 3, 4), large = make_run("wave", 0.1, 0.51, 3, 16);
  small.gascon_ms = ms(20);
  large.gascon_ms = ms(0.5);
  const std::vector<Floor> floors = find_floors(results_of({small, large}));
  expect_floor(floors, "new field / copy", "wave, cells of 4", 6, 6, true);
  expect_floor(floors, "new field / copy", "wave, cells of 16", 6.1, 6, false);
  expect_floor(floors, "gascon / new field", "wave, cells of 16", 0.5 / 0.61, 1, false);
  EXPECT_FALSE(find_floor(floors, "gascon / new field", "wave, cells of 4"));
}

TEST(GpuFloors, TwiceTheSlicesMayCostFivePercentMoreThanTwice) {
  const std::vector<Floor> floors = find_floors(results_of(
      {make_run("wave", 1, 1), make_run("wave", 2.3, 2.05, {}, 1, 600), make_run("wave", 1, 1, {}, 1, 1200)}));
  expect_floor(floors, "resample, slices", "wave, 600 / 300", 2.05, 2.1, true);
  expect_floor(floors, "new field, slices", "wave, 600 / 300", 2.175, 2.1, false);
  expect_floor(floors, "resample, slices", "wave, 1200 / 300", 1, 4.2, true);
}

TEST(GpuFloors, LocalIsTwiceAsFastAsTheFastestGlobalFieldOrCloseToTheBytes) {
  const std::vector<GpuRun> global{make_run("wave", 1, 1.2), make_run("elastic", 1, 1.6)};
  const auto with_local = [&](double resample) {
    std::vector<GpuRun> runs = global;
    runs.push_back(make_run("local", 1, resample));
    return find_floors(results_of(runs));
  };
  expect_floor(with_local(0.6), "wave / local, resample", "local", 2, 2, true);
  expect_floor(with_local(0.8), "wave / local, resample", "local", 1.5, 2, false);
  expect_floor(with_local(0.45), "resample / bytes", "local", 1.5, 1.5, true);
  expect_floor(find_floors(results_of({make_run("local", 1, 0.6)})), "resample / bytes", "local", 2, 1.5, false);
}

TEST(GpuFloors, MemoryMayBeATenthOr128MegabytesMoreThanTheData) {
  EXPECT_EQ((MemoryUse{.field = "", .data = 2'000'000'000}.allowed()), 2'200'000'000u);
  GpuResults results = results_of({});
  results.memory = {{.field = "wave", .data = 872'000'000, .host_views = 900'000'000, .device_views = 1'200'000'000}};
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "memory / allowed", "wave, host views", 0.9, 1, true);
  expect_floor(floors, "memory / allowed", "wave, device views", 1.2, 1, false);
}

TEST(GpuFloors, MeshesAreNoSlowerThanGascon) {
  GpuResults results = results_of({});
  results.meshes = {{.field = "wave",
                     .cell_size = 16,
                     .tetrahedra = 5,
                     .set_field_ms = ms(1),
                     .resample_ms = ms(1),
                     .gascon_ms = ms(2.5)},
                    {.field = "wave",
                     .cell_size = 32,
                     .tetrahedra = 5,
                     .set_field_ms = ms(1),
                     .resample_ms = ms(2),
                     .gascon_ms = ms(1.9)}};
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "gascon / mesh resample", "wave, cells of 16", 2.5, 1, true);
  expect_floor(floors, "gascon / mesh resample", "wave, cells of 32", 0.95, 1, false);
}

TEST(GpuFloors, WhatWasNotRunHasNoFloor) {
  EXPECT_TRUE(find_floors(results_of({})).empty());
  EXPECT_TRUE(find_floors(results_of({make_run("wave", 1, 1, {}, 1, 600)})).empty());
}

GpuResults small_results() {
  GpuRun run = make_run("wave", 1, 1, 5);
  run.report.covered = 7;
  GpuResults results = results_of({run, make_run("wave", 1, 3, 5, 4), make_run("wave", 2, 2, {}, 1, 600)});
  results.input_kind = "phantom";
  results.machine.gpu = "A GPU";
  results.meshes = {{.field = "wave",
                     .cell_size = 32,
                     .tetrahedra = 77,
                     .set_field_ms = ms(4),
                     .resample_ms = ms(1.25),
                     .gascon_ms = ms(2.5)}};
  results.loops = {{.cell_size = 1, .kernels = 500, .with_copies = 50, .copies_alone = 55, .host_views = 5}};
  results.memory = {{.field = "wave", .data = 1000, .host_views = 1100, .device_views = 50}};
  return results;
}

TEST(GpuReport, JsonHasEveryNumberAndEveryFloor) {
  const GpuResults results = small_results();
  const std::vector<Floor> floors = find_floors(results);
  const nlohmann::json document = to_json(results, floors);
  EXPECT_EQ(document["program"], "tetwarp-bench gpu");
  EXPECT_EQ(document["machine"]["gpu"], "A GPU");
  EXPECT_EQ(document["options"]["slices"], (nlohmann::json{300, 600}));
  EXPECT_DOUBLE_EQ(document["copies"]["bytes_floor_ms"], 0.3);
  ASSERT_EQ(document["runs"].size(), 3u);
  EXPECT_EQ(document["runs"][0]["paper_ms"]["median"], 5.0);
  EXPECT_EQ(document["runs"][0]["report"]["covered"], 7);
  EXPECT_TRUE(document["runs"][0]["gascon_ms"].is_null());
  EXPECT_EQ(document["meshes"][0]["tetrahedra"], 77);
  EXPECT_EQ(document["meshes"][0]["gascon_ms"]["median"], 2.5);
  EXPECT_EQ(document["frame_loops"][0]["copies_alone_per_s"], 55.0);
  EXPECT_EQ(document["memory"][0]["allowed_bytes"], 128'001'000);
  ASSERT_EQ(document["floors"].size(), floors.size());
  EXPECT_EQ(document["floors"][0]["required"], (nlohmann::json{{"limit", 6.0}, {"met", false}}));
  EXPECT_EQ(nlohmann::json::parse(document.dump()), document);
}

TEST(GpuReport, MarkdownHasTheTablesAndWhatCameOfTheFloors) {
  const GpuResults results = small_results();
  const std::string text = to_markdown(results, find_floors(results));
  EXPECT_TRUE(says(
      text, {"# tetwarp-bench gpu", "A GPU", "512 x 512 x 300", "## A vertex on every voxel", "## Larger cells",
             "## Meshes", "| wave | 32 | 77 |", "## Other lengths", "512 x 512 x 600", "## Frames per second",
             "## Memory", "## Floors", "| paper / resample | wave | 5.000 | at least 6 | missed | at least 15 | not",
             "| memory / allowed | wave, host views | 0.000 | at most 1 | met |  |  |"}));
}

}  // namespace
}  // namespace tetwarp::bench
