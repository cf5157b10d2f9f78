// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What is published of a measurement is what the script makes of its numbers.
#include <cmath>

#include "tests/bench/publish/publish.h"

namespace tetwarp::test {
namespace {

using Json = nlohmann::json;

Json numbers_of(const std::string& name) { return Json::parse(read_text(kResults / (name + ".json"))); }

Json ms(double median) { return {{"median", median}, {"q1", median}, {"q3", median}}; }

class PublishedTables : public Publish, public testing::WithParamInterface<const char*> {};
INSTANTIATE_TEST_SUITE_P(Results, PublishedTables,
                         testing::Values("paper-h100/paper", "cpu-epyc/cpu", "cpu-epyc/invert", "cpu-epyc/io",
                                         "gpu-h200/gpu", "gpu-h200/job", "itk-cpu/itk"));

TEST_P(PublishedTables, AreMadeOfTheNumbersBesideThem) {
  const std::string name = GetParam();
  ASSERT_EQ(publish(quoted(kResults / (name + ".json")) + " made.md").status, 0);
  EXPECT_TRUE(read_text(scratch_ / "made.md") == read_text(kResults / (name + ".md"))) << name;
}

using PublishFamilies = Publish;

TEST_F(PublishFamilies, TheLinesOfThePaperAreMadeOfItsNumbers) {
  ASSERT_EQ(publish(quoted(kResults / "paper-h100/paper.json") + " made.csv made.json").status, 0);
  EXPECT_TRUE(read_text(scratch_ / "made.csv") == read_text(kResults / "paper-h100/paper.csv"));
  EXPECT_TRUE(Json::parse(read_text(scratch_ / "made.json")) == numbers_of("paper-h100/paper"));
}

TEST_F(PublishFamilies, OfTheCpuTheTablesSayWhatIsLeftOut) {
  Json numbers = numbers_of("cpu-epyc/cpu");
  numbers["vtk"] = nullptr;
  numbers["growth_left_out"] = {{512, 512, 600}};
  numbers["larger_cells"] = Json::array();
  numbers["scaling"]["efficiency"] = 0.8;
  Json run = numbers["runs"][1];
  run["resample_ms"] = ms(30);
  run["new_field_ms"] = ms(40);
  run["bytes_ms"] = ms(16);
  run["paper"] = {{"ms", ms(200)}, {"differing", 0.25}};
  run["itk_warp"] = nullptr;
  numbers["runs"] = Json::array({run});
  Json slow = numbers["slow_peers"][1];
  slow["itk_invert_and_warp"]["ms"] = ms(4000);
  numbers["slow_peers"] = Json::array({slow});
  const std::string text = made_of(numbers, "md");
  EXPECT_TRUE(
      says(text, {"ITK 5.2.1", "VTK not in this build, left out", "## A vertex on every",
                  "| 5.00 | - | 2.50 | 1.88 | 25.000 % | - |", "| 512 x 512 x 40 | ITK invert and warp | 4000 |",
                  "Left out, 512 x 512 x 600", "Efficiency of a new field: 0.80"}));
  EXPECT_FALSE(says(text, {"## Larger cells"}));
}

TEST_F(PublishFamilies, OfAGpuEveryListHasItsTable) {
  Json numbers = numbers_of("gpu-h200/gpu");
  numbers["machine"]["gpu"] = "A GPU";
  Json mesh = numbers["meshes"][0];
  mesh.update({{"field", "wave"}, {"cell_size", 32}, {"tetrahedra", 77}});
  numbers["meshes"] = Json::array({mesh});
  numbers["floors"] = {{{"ratio", "paper / resample"},
                        {"where", "wave"},
                        {"value", 5.0},
                        {"at_least", true},
                        {"required", {{"limit", 6.0}, {"met", false}}},
                        {"aim", {{"limit", 15.0}, {"met", false}}}},
                       {{"ratio", "memory / allowed"},
                        {"where", "wave, host views"},
                        {"value", 0.0},
                        {"at_least", false},
                        {"required", {{"limit", 1.0}, {"met", true}}},
                        {"aim", nullptr}}};
  EXPECT_TRUE(
      says(made_of(numbers, "md"),
           {"# tetwarp-bench gpu", "A GPU", "512 x 512 x 300", "## A vertex on every voxel", "## Larger cells",
            "## Meshes", "| wave | 32 | 77 |", "## Other lengths", "512 x 512 x 600", "## Frames per second",
            "## Memory", "## Floors", "| paper / resample | wave | 5.000 | at least 6 | missed | at least 15 | not",
            "| memory / allowed | wave, host views | 0.000 | at most 1 | met |  |  |"}));
}

TEST_F(PublishFamilies, OfInversesErrorsAndSourcesAreTold) {
  Json numbers = numbers_of("cpu-epyc/invert");
  Json own = numbers["runs"][0], folds = own;
  own.update({{"field", "wave"},
              {"by", "tetwarp"},
              {"ms", ms(100)},
              {"cpu_ms", ms(200)},
              {"mean_error", 0.0001},
              {"percentile_99_error", 0.002},
              {"largest_error", 0.004}});
  folds.update({{"field", "folds"},
                {"mean_error", nullptr},
                {"percentile_99_error", nullptr},
                {"largest_error", nullptr},
                {"by", "ITK a"},
                {"ms", ms(1)},
                {"cpu_ms", ms(2)},
                {"with_source", 1000},
                {"left_out", 0},
                {"without_source", 70},
                {"written_without_source", 70},
                {"zero_without_source", 20},
                {"pointing_in_without_source", 40}});
  numbers["runs"] = {own, folds};
  numbers["itk"] = nullptr;
  EXPECT_TRUE(says(made_of(numbers, "md"),
                   {"# tetwarp-bench invert", "ITK not in this build, left out", "256 x 256 x 150",
                    "| wave | tetwarp | 100.0 (100.0-100.0) | 200.0 (200.0-200.0) | 0.0001 | 0.002 | 0.004 |",
                    "| folds | ITK a | 1.000 (1.000-1.000) | 2.000 (2.000-2.000) | - | - | - |",
                    "| folds | ITK a | 1000 | 0 | 70 | 70 | 20 | 40 |"}));
}

TEST_F(PublishFamilies, OfItksFiltersALineHoldsBothSides) {
  Json numbers = numbers_of("itk-cpu/itk");
  const auto run = [](const char* filters, bool own, double median, double rms) {
    return Json{
        {"task", "pull"},
        {"field", "elastic"},
        {"cell_size", 1},
        {"filters", filters},
        {"own", own},
        {"ms", ms(median)},
        {"cpu_ms", ms(2 * median)},
        {"input_bytes", 100000000},
        {"output_bytes", 40000000},
        {"peak_bytes_beyond_inputs", 50000000},
        {"error",
         {{"unit", "HU"}, {"rms", rms}, {"mean", rms}, {"largest", 2 * rms}, {"compared", 1000}, {"missing", 0}}}};
  };
  numbers["runs"] = {run("PullFieldResampleImageFilter", true, 100, 0.29), run("WarpImageFilter", false, 2500, 0.58)};
  EXPECT_TRUE(
      says(made_of(numbers, "md"),
           {"| WarpImageFilter | PullFieldResampleImageFilter | elastic, 1 | 2.50 / 0.100 | 25 | 50 / 50 (40) | "
            "0.58, 1.2 / 0.29, 0.58 HU |",
            "| elastic, 1 | WarpImageFilter | 2500.0 (2500.0-2500.0) |"}));
}

TEST_F(PublishFamilies, OlderSimulationsAreReadToo) {
  EXPECT_TRUE(says(made_of(numbers_of("render-h200/retractor"), "md"),
                   {"# tetwarp-bench simulate", "## Until it has settled", "| chainmail | cuda | 2 |"}));
}

TEST_F(PublishFamilies, WhatIsNoNumbersOfThePaperHasNoLines) {
  const Outcome run = publish(quoted(kResults / "cpu-epyc/cpu.json") + " made.csv");
  EXPECT_EQ(run.status, 1);
  EXPECT_TRUE(says(run.err, {"publish.py: error: of cpu there is Markdown alone"}));
}

}  // namespace
}  // namespace tetwarp::test
