// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A tiny run from end to end, and what is written of it.
#include "bench/harness/report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "bench/harness/machine.h"
#include "bench/paper/paper_bench.h"
#include "bench/paper/tables.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp::bench {
namespace {

const Results& tiny() {
  static const Results kResults = [] {
    Results results;
    results.options.input.width = 16;
    results.options.input.slices = {10, 12};
    results.options.fields = {"identity", "twist", "bubble-paper-1"};
    results.options.cell_sizes = {4};
    results.options.frames = 2;
    results.options.warmup = 0;
    results.backend = "cpu";
    results.input_kind = "phantom";
    results.machine = describe_machine(-1, 0);
    results.appendix = measure_appendix(10);
    results.runs = run_all(results.options, *make_cpu_backend(0), [](const std::string&) {});
    return results;
  }();
  return kResults;
}

std::vector<std::string> keys(const nlohmann::json& object) {
  std::vector<std::string> names;
  for (const auto& [key, value] : object.items()) names.push_back(key);
  return names;
}

TEST(BenchReport, EveryMethodRunsOnEveryFieldAndTheCoarseCellsOnOneVolume) {
  // 2 sizes x 2 fields x 5 methods x 2 sources, 2 fields x 3 methods x 2 sources with cells of four, and in the kernel
  // alone 4 methods with an inverse per voxel on 2 fields, and 9 methods on the field as the paper writes it
  EXPECT_EQ(tiny().runs.size(), 40u + 12u + 8u + 9u);
  for (const bench::Run& run : tiny().runs) {
    EXPECT_EQ(run.kernel_ms.frames, 2);
    EXPECT_TRUE(run.cell_size == 1 || run.size == glm::i64vec3(16, 16, 10));
  }
}

TEST(BenchReport, JsonHasEveryKey) {
  const nlohmann::json document = to_json(tiny());
  EXPECT_EQ(keys(document), (std::vector<std::string>{"appendix_a", "commit", "input", "machine", "options", "program",
                                                      "published", "runs", "version"}));
  EXPECT_EQ(document["program"], "tetwarp-bench paper");
  EXPECT_EQ(keys(document["machine"]),
            (std::vector<std::string>{"compute_capability", "cpu", "cuda_runtime", "driver", "gpu", "threads"}));
  EXPECT_TRUE(document["machine"]["gpu"].is_null());
  EXPECT_EQ(document["input"], (nlohmann::json{{"kind", "phantom"}, {"seed", 1}}));
  for (const std::string key : {"frames", "warmup", "backend", "methods", "fields"}) {
    EXPECT_TRUE(document["options"].contains(key)) << key;
  }
  ASSERT_EQ(document["runs"].size(), tiny().runs.size());
  for (const nlohmann::json& run : document["runs"]) {
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

TEST(BenchReport, JsonSurvivesBeingWrittenAndRead) {
  const nlohmann::json document = to_json(tiny());
  EXPECT_EQ(nlohmann::json::parse(document.dump()), document);
}

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
  EXPECT_EQ(lines, tiny().runs.size() + 1);
}

TEST(BenchReport, MarkdownHasTheTablesAndTheirMethods) {
  const std::string text = to_markdown(tiny());
  EXPECT_TRUE(
      says(text, {"## Table 2", "## Table 3", "## Table 4", "## Larger cells", "## Appendix A", "2.01017761",
                  "| 16 x 16 x 12 | twist | inverse4x4-double | ", "| 16 x 16 x 12 | twist | tetwarp | ",
                  "| 16 x 16 x 10 | twist | 4 | gascon | ", "| 16 x 16 x 10 | bubble-paper-1 | paper-per-voxel | "}));
}

TEST(BenchReport, SpeedUpIsAgainstTheSameFieldAndSourceWithSetFieldCounted) {
  Results results;
  bench::Run slow, fast;
  slow.method = Method::inverse4x4_double;
  slow.kernel_ms.median = 12;
  fast.method = Method::tetwarp;
  fast.kernel_ms.median = 2;
  fast.total_ms = Summary{.median = 3};
  bench::Run elsewhere = slow;
  elsewhere.source = FieldSource::memory;
  elsewhere.kernel_ms.median = 1000;
  results.runs = {elsewhere, slow, fast};
  EXPECT_EQ(speed_up(results, fast, Method::inverse4x4_double), 4);
  EXPECT_EQ(speed_up(results, fast, Method::inverse3x3_float), std::nullopt);
}

TEST(BenchReport, AVolumeOfZerosIsNotTimed) {
  const Scratch scratch;
  write_file(scratch / "zeros.raw", std::string(2 * 24, '\0'));
  PaperOptions options;
  options.input.raw = scratch / "zeros.raw";
  options.input.size = {4, 3, 2};
  EXPECT_THROW(run_all(options, *make_cpu_backend(0), [](const std::string&) {}), InputError);
}

}  // namespace
}  // namespace tetwarp::bench
