// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `io`, from given medians.
#include "bench/io/io.h"

#include <gtest/gtest.h>

#include "tests/support/floors.h"

namespace tetwarp::bench {
namespace {

using test::expect_floor;
using test::find_floor;

struct IoTime {
  std::string step, by;
  double ms;
};

Json results_of(const std::vector<IoTime>& times) {
  Json results{{"machine", {{"threads", 2}}}, {"times", Json::array()}};
  for (const IoTime& time : times)
    results["times"].push_back(time_json(time.step, time.by, {{"ms", {time.ms}}, {"cpu_ms", {2 * time.ms}}}));
  return results;
}

TEST(IoFloors, UncompressedSeriesAreHeldAgainstItkAndAgainstTheLoopOnAsManyThreads) {
  const std::string step = "DICOM in, uncompressed";
  const Floors floors = find_io_floors(results_of({{step, "tetwarp", 120}, {step, "ITK", 186}, {step, "DCMTK", 100}}));
  ASSERT_EQ(floors.size(), 2u);
  expect_floor(floors, "ITK / tetwarp", step, 1.55, 1.5, true);
  expect_floor(floors, "tetwarp / DCMTK", step, 1.2, 1.1, false);
  EXPECT_FALSE(all_met(floors));
}

TEST(IoFloors, AJobWithCudaIsHeldAgainstInAndOutAlone) {
  const std::string step = "whole job, cells of 16";
  const std::vector<IoTime> times{
      {step, "tetwarp deform, CUDA", 280}, {step, "in alone", 120}, {step, "out alone", 80}};
  expect_floor(find_io_floors(results_of(times)), "program with CUDA / in and out", step, 1.4, 1.3, false);
}

TEST(IoFloors, CompressedSeriesAreHeldAgainstTheLoopOnOneThread) {
  for (const std::string coding : {"JPEG lossless", "JPEG-LS", "RLE"}) {
    const std::string step = "DICOM in, " + coding;
    Json results = results_of({{step, "tetwarp", 100}, {step, "ITK", 90}, {step, "DCMTK, 1 thread", 160}});
    const Floors floors = find_io_floors(results);
    expect_floor(floors, "DCMTK, 1 thread / tetwarp", step, 1.6, 1.7, false);
    expect_floor(floors, "ITK / tetwarp", step, 0.9, {}, true);
    results["machine"]["threads"] = 1;
    EXPECT_TRUE(all_met(find_io_floors(results))) << "one thread is not held to what two are";
  }
}

TEST(IoFloors, WritersAreNoSlowerThanItkAndTwiceAsFastIsAnAim) {
  const Floors floors = find_io_floors(results_of({{"DICOM out", "tetwarp", 100}, {"DICOM out", "ITK", 150}}));
  expect_floor(floors, "ITK / tetwarp", "DICOM out", 1.5, 1, true);
  EXPECT_EQ(find_floor(floors, "ITK / tetwarp", "DICOM out")->aim, 2);
  EXPECT_TRUE(all_met(floors));
}

TEST(IoFloors, GzippedNiftiIsHeldToTimeAndSize) {
  Json results = results_of({{".nii.gz out", "tetwarp", 100},
                             {".nii.gz out", "ITK", 1100},
                             {".nii.gz in, written by ITK", "tetwarp", 10},
                             {".nii.gz in, written by ITK", "ITK", 21},
                             {".nii.gz in, written by tetwarp", "tetwarp", 10},
                             {".nii.gz in, written by tetwarp", "ITK", 15}});
  results["sizes"] = {{{"file", "nii.gz"}, {"by", "ITK"}, {"bytes", 1000}},
                      {{"file", "nii.gz"}, {"by", "tetwarp"}, {"bytes", 1031}}};
  const Floors floors = find_io_floors(results);
  expect_floor(floors, "ITK / tetwarp", ".nii.gz out", 11, 12, false);
  expect_floor(floors, "bytes, tetwarp / ITK", ".nii.gz out", 1.031, 1.03, false);
  expect_floor(floors, "ITK / tetwarp", ".nii.gz in, written by ITK", 2.1, 2, true);
  expect_floor(floors, "ITK / tetwarp", ".nii.gz in, written by tetwarp", 1.5, {}, true);
}

TEST(IoFloors, TheWholeJobIsHeldAgainstTheSumOfAllItsStages) {
  const std::string step = "whole job, cells of 4";
  std::vector<IoTime> times = {{step, "tetwarp deform", 106}, {step, "in alone", 30},  {step, "field alone", 5},
                               {step, "deform alone", 45},    {step, "out alone", 17}, {step, "memory given back", 3}};
  expect_floor(find_io_floors(results_of(times)), "program / sum of its stages", step, 1.06, 1.05, false);
  times.pop_back();
  EXPECT_TRUE(find_io_floors(results_of(times)).empty()) << "a sum without one of its stages";
}

TEST(IoFloors, WhatWasNotRunHasNoFloor) { EXPECT_TRUE(find_io_floors(results_of({})).empty()); }

TEST(IoReport, ARowHasBothTimes) {
  const Json row = time_json("DICOM out", "tetwarp", {{"ms", {100}}, {"cpu_ms", {180}}});
  EXPECT_EQ(row["step"], "DICOM out");
  EXPECT_EQ(row["by"], "tetwarp");
  EXPECT_EQ(row["ms"]["median"], 100.0);
  EXPECT_EQ(row["cpu_ms"]["median"], 180.0);
}

}  // namespace
}  // namespace tetwarp::bench
