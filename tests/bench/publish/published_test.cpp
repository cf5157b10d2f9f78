// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The paper's own numbers, and which of ours may stand beside them.
#include <cmath>
#include <sstream>

#include "tests/bench/publish/publish.h"

namespace tetwarp::test {
namespace {

using Json = nlohmann::json;

const std::vector<std::string> kGpus{"GeForce RTX 2080", "GeForce GTX 1650 Mobile"};
const std::vector<std::string> kMethods{"inverse4x4-double", "inverse3x3-double", "inverse3x3-float", "paper"};

Json ms(double median) { return {{"median", median}, {"q1", 0}, {"q3", 0}, {"min", 0}, {"max", 0}, {"frames", 1}}; }

/// Wave as the paper writes it, 512 x 512 x 300, Algorithm 2 in 2.5 ms, on a GPU.
Json run_with_the_papers_settings() {
  return {{"size", {512, 512, 300}},
          {"field", "wave-paper-1"},
          {"formula", "wave:"},
          {"cell_size", 1},
          {"method", "paper"},
          {"field_source", "kernel"},
          {"kernel_ms", ms(2.5)},
          {"field_ms", nullptr},
          {"total_ms", nullptr},
          {"copy_in_ms", nullptr},
          {"copy_out_ms", nullptr},
          {"end_to_end_ms", nullptr},
          {"writes", 1},
          {"voxels_lost", 0},
          {"voxels_multiple", 0},
          {"voxels_spilled", 0},
          {"largest_difference", 0.0},
          {"mean_difference", 0.0},
          {"exact_covered", 1}};
}

class Published : public Publish {
 protected:
  void SetUp() override {
    Publish::SetUp();
    whole_ = Json::parse(read_text(kResults / "paper-h100/paper.json"));
    whole_.erase("published");
  }
  Json numbers_of(const std::vector<Json>& runs, const std::string& backend = "cuda") const {
    Json numbers = whole_;
    numbers["options"]["backend"] = backend;
    numbers["runs"] = runs;
    return numbers;
  }
  Json published(const Json& numbers) const { return Json::parse(made_of(numbers, "json"))["published"]; }
  /// The paper's cells that have ours beside them, once for each way.
  static std::vector<std::pair<Json, Json>> measured(const Json& found) {
    std::vector<std::pair<Json, Json>> all;
    for (const Json& cell : found["times"])
      for (const Json& ours : cell["ours"])
        if (!ours["ms"].is_null()) all.emplace_back(cell, ours);
    return all;
  }
  /// The last cells of the only line.
  std::string csv_cells(const Json& numbers) const {
    std::istringstream csv(made_of(numbers, "csv"));
    std::string line;
    std::getline(csv, line);
    std::getline(csv, line);
    std::size_t at = line.size();
    for (int n = 0; n < 4; ++n) at = line.rfind(',', at - 1);
    return line.substr(at);
  }

  Json whole_;
};

double published_ms(const Json& found, int table, const std::string& method, const std::string& transform,
                    const std::string& data, const std::string& gpu) {
  double ms = NAN;
  int count = 0;
  for (const Json& time : found["times"]) {
    if (time["table"] != table || time["method"] != method || time["transform"] != transform || time["data"] != data ||
        time["gpu"] != gpu)
      continue;
    ms = time["ms"];
    ++count;
  }
  EXPECT_EQ(count, 1) << table << transform << data;
  return ms;
}

TEST_F(Published, SpeedUpsAreTheQuotientsOfTheTimes) {
  const Json found = published(numbers_of({run_with_the_papers_settings()}));
  ASSERT_EQ(found["speed_ups"].size(), 12u);
  for (const Json& printed : found["speed_ups"]) {
    const double slow = published_ms(found, printed["table"], printed["slow"], printed["transform"], "abdomen",
                                     printed["gpu"]),
                 fast = published_ms(found, printed["table"], printed["fast"], printed["transform"], "abdomen",
                                     printed["gpu"]);
    EXPECT_NEAR(slow / fast, printed["ratio"], 0.012) << printed;
  }
}

TEST_F(Published, WhatStandsInTwoTablesIsTheSame) {
  const Json found = published(numbers_of({run_with_the_papers_settings()}));
  ASSERT_EQ(found["times"].size(), 18u + 12u + 8u);
  for (const std::string& gpu : kGpus) {
    for (const std::string transform : {"wave", "twist", "bubble"}) {
      EXPECT_EQ(published_ms(found, 2, "inverse3x3-float", transform, "abdomen", gpu),
                published_ms(found, 3, "inverse3x3-float", transform, "abdomen", gpu));
    }
  }
  for (const std::string method : {"inverse3x3-float", "paper"}) {
    EXPECT_EQ(published_ms(found, 3, method, "wave", "abdomen", kGpus[1]),
              published_ms(found, 4, method, "wave", "abdomen", kGpus[1]));
  }
}

TEST_F(Published, ARunWithThePapersSettingsStandsBesideEveryCellOfItsKind) {
  const Json numbers = numbers_of({run_with_the_papers_settings()});
  const auto found = measured(published(numbers));
  ASSERT_EQ(found.size(), 3u);  // Table 3 on both of its GPUs, Table 4 on one
  for (const auto& [cell, ours] : found) {
    EXPECT_EQ(ours["field"], "wave-paper-1");
    EXPECT_EQ(ours["method"], "paper");
    EXPECT_EQ(ours["ratio"], cell["ms"].get<double>() / 2.5);
  }
  EXPECT_TRUE(
      says(made_of(numbers, "md"), {"| wave | (b) | paper | 1 | 19.75 | 51.27 | 2.500 (0.000-0.000) | 7.90 | 20.51 |",
                                    "| abdomen | 300 | paper | 1 | 51.27 | 2.500 (0.000-0.000) | 20.51 |"}));
  EXPECT_EQ(csv_cells(numbers), ",19.75,7.9,51.27,20.508");
}

TEST_F(Published, AnyOtherSettingLeavesThePapersCellsAlone) {
  const auto differs = [&](const char* key, const Json& value) {
    Json run = run_with_the_papers_settings();
    run[key] = value;
    EXPECT_TRUE(measured(published(numbers_of({run}))).empty()) << key;
  };
  differs("size", {512, 512, 299});
  differs("size", {256, 512, 300});
  differs("field_source", "memory");
  differs("cell_size", 4);
  differs("field", "wave");
  differs("method", "tetwarp");
  EXPECT_TRUE(measured(published(numbers_of({run_with_the_papers_settings()}, "cpu"))).empty());
}

TEST_F(Published, TheReportSaysWhyACellStandsAlone) {
  Json run = run_with_the_papers_settings();
  run["size"] = {64, 64, 40};
  const Json numbers = numbers_of({run}, "cpu"), found = published(numbers);
  EXPECT_TRUE(
      says(made_of(numbers, "md"), {"| wave | (a) | inverse4x4-double-per-voxel | 16 | 348.14 | 892.85 | - | - | - |",
                                    "on a CPU", "not run here: 512 x 512 x 300", "fields left out: wave-paper-16",
                                    "methods left out: inverse4x4-double, inverse4x4-double-per-voxel"}));
  EXPECT_EQ(csv_cells(numbers), ",,,,");
  EXPECT_EQ(found["times"].size(), 38u);
  EXPECT_EQ(found["why_apart"].size(), 4u);
  for (const Json& time : found["times"]) {
    EXPECT_EQ(time["ours"].size(), 4u) << "two amplitudes, two places of the inverse";
    for (const Json& ours : time["ours"]) EXPECT_TRUE(ours["ratio"].is_null());
  }
}

TEST_F(Published, NothingKeepsApartWhatRanInFull) {
  std::vector<Json> runs;
  for (const int slices : {141, 300, 316, 600}) {
    for (const std::string transform : {"wave", "twist", "bubble"}) {
      for (const std::string amplitude : {"1", "16"}) {
        for (const std::string& method : kMethods) {
          for (const std::string twin : {"", "-per-voxel"}) {
            Json run = run_with_the_papers_settings();
            run.update({{"size", {512, 512, slices}},
                        {"field", transform + "-paper-" + amplitude},
                        {"method", method + twin}});
            runs.push_back(run);
          }
        }
      }
    }
  }
  const Json found = published(numbers_of(runs));
  EXPECT_TRUE(found["why_apart"].empty()) << found["why_apart"];
  EXPECT_EQ(measured(found).size(), 4 * found["times"].size());
}

TEST_F(Published, SpeedUpIsAgainstTheSameFieldAndSourceWithSetFieldCounted) {
  Json slow = run_with_the_papers_settings(), fast = slow;
  slow.update({{"field", "wave"}, {"method", "inverse4x4-double"}, {"kernel_ms", ms(12)}});
  fast.update(
      {{"field", "wave"}, {"method", "tetwarp"}, {"kernel_ms", ms(2)}, {"total_ms", ms(3)}, {"field_ms", ms(1)}});
  Json elsewhere = slow;
  elsewhere.update({{"field_source", "memory"}, {"kernel_ms", ms(1000)}});
  const std::string csv = made_of(numbers_of({elsewhere, slow, fast}), "csv");
  EXPECT_TRUE(csv.ends_with(",4,,,,,\n")) << csv << "4 times the first, and the second was not run";
}

TEST_F(Published, TheTablesHaveTheirMethods) {
  ASSERT_EQ(run_tetwarp(scratch_.path(),
                        "paper --backend cpu --width 16 --slices 10,12 --fields identity,twist,bubble-paper-1 "
                        "--cell-sizes 4 --frames 2 --warmup 0 --json r.json")
                .status,
            0);
  ASSERT_EQ(publish("r.json r.md").status, 0);
  EXPECT_TRUE(says(read_text(scratch_ / "r.md"),
                   {"## Table 2", "## Table 3", "## Table 4", "## Larger cells", "## Appendix A", "2.01017761",
                    "| 16 x 16 x 12 | twist | inverse4x4-double | ", "| 16 x 16 x 12 | twist | tetwarp | ",
                    "| 16 x 16 x 10 | twist | 4 | gascon | ", "| 16 x 16 x 10 | bubble-paper-1 | paper-per-voxel | "}));
}

}  // namespace
}  // namespace tetwarp::test
