// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A tiny run from end to end, and what is written of it.
#include "bench/harness/results.h"

#include <gtest/gtest.h>

#include <sstream>

#include "bench/paper/paper.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp::bench {
namespace {

/// The rows of a tiny run.
const Json& tiny() {
  static const Json kRuns = [] {
    Options options = default_options("paper");
    options.input.width = 16;
    options.input.slices = {10, 12};
    options.fields = {"identity", "twist", "bubble-paper-1"};
    options.cell_sizes = {4};
    options.frames = 2;
    options.warmup = 0;
    return run_all(options, *make_cpu_backend(0));
  }();
  return kRuns;
}

std::vector<std::string> keys(const nlohmann::json& object) {
  std::vector<std::string> names;
  for (const auto& [key, value] : object.items()) names.push_back(key);
  return names;
}

TEST(BenchReport, EveryMethodRunsOnEveryFieldAndTheCoarseCellsOnOneVolume) {
  // 2 sizes x 2 fields x 5 methods x 2 sources, 2 fields x 3 methods x 2 sources with cells of four, and in the kernel
  // alone 4 methods with an inverse per voxel on 2 fields, and 9 methods on the field as the paper writes it
  EXPECT_EQ(tiny().size(), 40u + 12u + 8u + 9u);
  for (const Json& run : tiny()) {
    EXPECT_EQ(run["kernel_ms"]["frames"], 2);
    EXPECT_TRUE(run["cell_size"] == 1 || run["size"] == (Json{16, 16, 10}));
  }
}

TEST(BenchReport, EveryRowHasEveryKey) {
  for (const Json& run : tiny()) {
    EXPECT_EQ(keys(run), (std::vector<std::string>{
                             "cell_size", "copy_in_ms",         "copy_out_ms",     "end_to_end_ms",  "exact_covered",
                             "field",     "field_ms",           "field_source",    "formula",        "inverse",
                             "kernel_ms", "largest_difference", "mean_difference", "method",         "size",
                             "total_ms",  "voxels_lost",        "voxels_multiple", "voxels_spilled", "writes"}));
    EXPECT_EQ(keys(run["kernel_ms"]), (std::vector<std::string>{"frames", "max", "median", "min", "q1", "q3"}));
    EXPECT_EQ(run["field_ms"].is_null(), run["method"] != "tetwarp");
    EXPECT_TRUE(run["copy_in_ms"].is_null());
  }
}

TEST(BenchReport, RowsSurviveBeingWrittenAndRead) { EXPECT_EQ(Json::parse(tiny().dump()), tiny()); }

TEST(BenchReport, CsvHasALineARunAndAsManyCellsInEach) {
  std::istringstream csv(to_csv(tiny()));
  std::string line;
  std::size_t lines = 0, cells = 0;
  while (std::getline(csv, line)) {
    std::size_t commas = 0;
    bool quoted = false;
    for (const char c : line) {
      quoted ^= c == '"';
      commas += c == ',' && !quoted;
    }
    if (lines++ == 0) cells = commas;
    EXPECT_EQ(commas, cells) << line;
  }
  EXPECT_EQ(lines, tiny().size() + 1);
}

TEST(BenchReport, TheTextHasFactsAndATableOfEachList) {
  const Json document{
      {"program", "tetwarp-bench some"},
      {"version", "1.2"},
      {"commit", "abc"},
      {"machine", {{"cpu", "A CPU"}, {"threads", 2}, {"gpu", nullptr}}},
      {"itk", nullptr},
      {"runs",
       {{{"field", "wave"}, {"size", {5, 6, 7}}, {"new_field_ms", summarize({1, 2, 3})}, {"paper", nullptr}},
        {{"field", "local"}, {"size", {5, 6, 7}}, {"new_field_ms", summarize({20})}}}},
      {"frame_loops", Json::array()}};
  Floors floors;
  floors.at_least("paper / new field", "wave", 10, 2, 6, 20);
  EXPECT_EQ(to_text(document, floors), R"(# tetwarp-bench some, 1.2 (abc)

- machine: cpu A CPU; threads 2
- itk: -

## Runs

size: 5 x 6 x 7
field  new_field_ms
wave   2.000 (1.500-2.500)
local  20.00 (20.00-20.00)

## Floors

ratio              where  value  required            aim
paper / new field  wave   5.000  at least 6, missed  at least 20, missed

)");
}

TEST(BenchReport, AVolumeOfZerosIsNotTimed) {
  const Scratch scratch;
  write_file(scratch / "zeros.raw", std::string(2 * 24, '\0'));
  Options options = default_options("paper");
  options.input.raw = scratch / "zeros.raw";
  options.input.size = {4, 3, 2};
  EXPECT_THROW(run_all(options, *make_cpu_backend(0)), InputError);
}

}  // namespace
}  // namespace tetwarp::bench
