// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `io`, from given medians, and what is written of them.
#include "bench/io/io_floors.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bench/io/io_report.h"
#include "tests/support/floors.h"
#include "tests/support/says.h"

namespace tetwarp::bench {
namespace {

using test::expect_floor;
using test::find_floor;

Summary ms(double median) { return {median, median, median, median, median, 5}; }

IoResults results_of(const std::vector<IoTime>& times) {
  IoResults results{.options = {}, .machine = {}, .size = {512, 512, 300}, .times = times};
  results.machine.threads = 2;
  return results;
}

TEST(IoFloors, UncompressedSeriesAreHeldAgainstItkAndAgainstTheLoopOnAsManyThreads) {
  const std::string step = "DICOM in, uncompressed";
  const std::vector<Floor> floors =
      find_floors(results_of({{step, "tetwarp", ms(120)}, {step, "ITK", ms(186)}, {step, "DCMTK", ms(100)}}));
  ASSERT_EQ(floors.size(), 2u);
  expect_floor(floors, "ITK / tetwarp", step, 1.55, 1.5, true);
  expect_floor(floors, "tetwarp / DCMTK", step, 1.2, 1.1, false);
  EXPECT_FALSE(all_met(floors));
}

TEST(IoFloors, AJobWithCudaIsHeldAgainstInAndOutAlone) {
  const std::string step = "whole job, cells of 16";
  const std::vector<IoTime> times{
      {step, "tetwarp deform, CUDA", ms(280)}, {step, "in alone", ms(120)}, {step, "out alone", ms(80)}};
  expect_floor(find_floors(results_of(times)), "program with CUDA / in and out", step, 1.4, 1.3, false);
}

TEST(IoFloors, CompressedSeriesAreHeldAgainstTheLoopOnOneThread) {
  for (const std::string coding : {"JPEG lossless", "JPEG-LS", "RLE"}) {
    const std::string step = "DICOM in, " + coding;
    IoResults results =
        results_of({{step, "tetwarp", ms(100)}, {step, "ITK", ms(90)}, {step, "DCMTK, 1 thread", ms(160)}});
    const std::vector<Floor> floors = find_floors(results);
    expect_floor(floors, "DCMTK, 1 thread / tetwarp", step, 1.6, 1.7, false);
    expect_floor(floors, "ITK / tetwarp", step, 0.9, {}, true);
    results.machine.threads = 1;
    EXPECT_TRUE(all_met(find_floors(results))) << "one thread is not held to what two are";
  }
}

TEST(IoFloors, WritersAreNoSlowerThanItkAndTwiceAsFastIsAnAim) {
  const std::vector<Floor> floors =
      find_floors(results_of({{"DICOM out", "tetwarp", ms(100)}, {"DICOM out", "ITK", ms(150)}}));
  expect_floor(floors, "ITK / tetwarp", "DICOM out", 1.5, 1, true);
  EXPECT_EQ(find_floor(floors, "ITK / tetwarp", "DICOM out")->aim, 2);
  EXPECT_TRUE(all_met(floors));
}

TEST(IoFloors, GzippedNiftiIsHeldToTimeAndSize) {
  IoResults results = results_of({{".nii.gz out", "tetwarp", ms(100)},
                                  {".nii.gz out", "ITK", ms(1100)},
                                  {".nii.gz in, written by ITK", "tetwarp", ms(10)},
                                  {".nii.gz in, written by ITK", "ITK", ms(21)},
                                  {".nii.gz in, written by tetwarp", "tetwarp", ms(10)},
                                  {".nii.gz in, written by tetwarp", "ITK", ms(15)}});
  results.sizes = {{"nii.gz", "ITK", 1000}, {"nii.gz", "tetwarp", 1031}};
  const std::vector<Floor> floors = find_floors(results);
  expect_floor(floors, "ITK / tetwarp", ".nii.gz out", 11, 12, false);
  expect_floor(floors, "bytes, tetwarp / ITK", ".nii.gz out", 1.031, 1.03, false);
  expect_floor(floors, "ITK / tetwarp", ".nii.gz in, written by ITK", 2.1, 2, true);
  expect_floor(floors, "ITK / tetwarp", ".nii.gz in, written by tetwarp", 1.5, {}, true);
}

TEST(IoFloors, TheWholeJobIsHeldAgainstTheSumOfAllItsStages) {
  const std::string step = "whole job, cells of 4";
  std::vector<IoTime> times = {{step, "tetwarp deform", ms(106)}, {step, "in alone", ms(30)},
                               {step, "field alone", ms(5)},      {step, "deform alone", ms(45)},
                               {step, "out alone", ms(17)},       {step, "memory given back", ms(3)}};
  expect_floor(find_floors(results_of(times)), "program / sum of its stages", step, 1.06, 1.05, false);
  times.pop_back();
  EXPECT_TRUE(find_floors(results_of(times)).empty()) << "a sum without one of its stages";
}

TEST(IoFloors, WhatWasNotRunHasNoFloor) { EXPECT_TRUE(find_floors(results_of({})).empty()); }

TEST(IoReport, JsonHasEveryTimeSizeAndFloor) {
  IoResults results = results_of({{"DICOM out", "tetwarp", ms(100), ms(180)}, {"DICOM out", "ITK", ms(90), ms(90)}});
  results.sizes = {{"nii.gz", "ITK", 1000}};
  const std::vector<Floor> floors = find_floors(results);
  const nlohmann::json document = to_json(results, floors);
  EXPECT_EQ(document["program"], "tetwarp-bench io");
  EXPECT_EQ(document["page_cache"], true);
  EXPECT_EQ(document["times"][0]["step"], "DICOM out");
  EXPECT_EQ(document["times"][0]["ms"]["median"], 100.0);
  EXPECT_EQ(document["times"][0]["cpu_ms"]["median"], 180.0);
  EXPECT_EQ(document["sizes"][0]["bytes"], 1000);
  EXPECT_EQ(document["floors"][0]["required"], (nlohmann::json{{"limit", 1.0}, {"met", false}}));
}

TEST(IoReport, MarkdownSaysWhereTheFilesAreAndWhatCameOfTheFloors) {
  const IoResults results = results_of({{"DICOM out", "tetwarp", ms(100)}, {"DICOM out", "ITK", ms(90)}});
  EXPECT_TRUE(
      says(to_markdown(results, find_floors(results)),
           {"# tetwarp-bench io", "512 x 512 x 300", "page cache", "| DICOM out | tetwarp | 100.0 (100.0-100.0)",
            "| ITK / tetwarp | DICOM out | 0.900 | at least 1 | missed | at least 2 | not reached |"}));
}

}  // namespace
}  // namespace tetwarp::bench
