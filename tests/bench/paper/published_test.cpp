// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The paper's own numbers, and which of ours may stand beside them.
#include "bench/paper/published.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/paper/baselines.h"
#include "bench/paper/beside.h"
#include "bench/paper/published_tables.h"
#include "tests/support/says.h"

namespace tetwarp::bench {
namespace {

double published_ms(int table, Method method, const std::string& transform, const std::string& data, PublishedGpu gpu) {
  double ms = NAN;
  int found = 0;
  for (const PublishedTime& time : published_times()) {
    if (time.table != table || time.method != method || time.transform != transform || time.data != data ||
        time.gpu != gpu)
      continue;
    ms = time.ms;
    ++found;
  }
  EXPECT_EQ(found, 1) << table << transform << data;
  return ms;
}

/// Wave as the paper writes it, 512 x 512 x 300, Algorithm 2 in 2.5 ms, on a GPU.
bench::Run run_with_the_papers_settings() {
  bench::Run run;
  run.size = {512, 512, 300};
  run.field = "wave-paper-1";
  run.method = Method::paper;
  run.source = FieldSource::kernel;
  run.kernel_ms.median = 2.5;
  return run;
}

Results results_of(const bench::Run& run, const std::string& backend = "cuda") {
  Results results;
  results.backend = backend;
  results.input_kind = "phantom";
  results.runs = {run};
  return results;
}

std::vector<Beside> measured(const Results& results) {
  std::vector<Beside> found = beside_the_paper(results);
  std::erase_if(found, [](const Beside& beside) { return !beside.ours; });
  return found;
}

TEST(BenchPublished, SpeedUpsAreTheQuotientsOfTheTimes) {
  ASSERT_EQ(published_speed_ups().size(), 12u);
  for (const PublishedSpeedUp& printed : published_speed_ups()) {
    const double slow = published_ms(printed.table, printed.slow, printed.transform, "abdomen", printed.gpu),
                 fast = published_ms(printed.table, printed.fast, printed.transform, "abdomen", printed.gpu);
    EXPECT_NEAR(slow / fast, printed.ratio, 0.012) << printed.table << printed.transform;
  }
}

TEST(BenchPublished, WhatStandsInTwoTablesIsTheSame) {
  ASSERT_EQ(published_times().size(), 18u + 12u + 8u);
  for (const PublishedGpu gpu : {PublishedGpu::rtx_2080, PublishedGpu::gtx_1650_mobile}) {
    for (const std::string transform : {"wave", "twist", "bubble"}) {
      EXPECT_EQ(published_ms(2, Method::inverse3x3_float, transform, "abdomen", gpu),
                published_ms(3, Method::inverse3x3_float, transform, "abdomen", gpu));
    }
  }
  for (const Method method : {Method::inverse3x3_float, Method::paper}) {
    EXPECT_EQ(published_ms(3, method, "wave", "abdomen", PublishedGpu::gtx_1650_mobile),
              published_ms(4, method, "wave", "abdomen", PublishedGpu::gtx_1650_mobile));
  }
}

TEST(BenchPublished, ARunWithThePapersSettingsStandsBesideEveryCellOfItsKind) {
  const Results results = results_of(run_with_the_papers_settings());
  const std::vector<Beside> found = measured(results);
  ASSERT_EQ(found.size(), 3u);  // Table 3 on both of its GPUs, Table 4 on one
  for (const Beside& beside : found) {
    EXPECT_EQ(beside.ours, &results.runs.front());
    EXPECT_EQ(ratio(beside), beside.paper->ms / 2.5);
  }
  EXPECT_TRUE(says(published_tables(results),
                   {"| wave | (b) | paper | 1 | 19.75 | 51.27 | 2.500 (0.000-0.000) | 7.90 | 20.51 |",
                    "| abdomen | 300 | paper | 1 | 51.27 | 2.500 (0.000-0.000) | 20.51 |"}));
  EXPECT_EQ(published_csv_cells(results, results.runs.front()), ",19.75,7.9,51.27,20.508");
}

TEST(BenchPublished, AnyOtherSettingLeavesThePapersCellsAlone) {
  const auto differs = [](const char* what, const auto& change) {
    bench::Run run = run_with_the_papers_settings();
    change(run);
    EXPECT_TRUE(measured(results_of(run)).empty()) << what;
  };
  differs("slices", [](bench::Run& run) { run.size.z = 299; });
  differs("columns", [](bench::Run& run) { run.size.x = 256; });
  differs("field in memory", [](bench::Run& run) { run.source = FieldSource::memory; });
  differs("larger cells", [](bench::Run& run) { run.cell_size = 4; });
  differs("our wave", [](bench::Run& run) { run.field = "wave"; });
  differs("a method of ours", [](bench::Run& run) { run.method = Method::tetwarp; });
  EXPECT_TRUE(measured(results_of(run_with_the_papers_settings(), "cpu")).empty());
}

TEST(BenchPublished, TheReportSaysWhyACellStandsAlone) {
  bench::Run run = run_with_the_papers_settings();
  run.size = {64, 64, 40};
  const Results results = results_of(run, "cpu");
  EXPECT_TRUE(says(published_tables(results),
                   {"| wave | (a) | inverse4x4-double-per-voxel | 16 | 348.14 | 892.85 | - | - | - |", "on a CPU",
                    "not run here: 512 x 512 x 300", "fields left out: wave-paper-16",
                    "methods left out: inverse4x4-double, inverse4x4-double-per-voxel"}));
  EXPECT_EQ(published_csv_cells(results, results.runs.front()), ",,,,");
  const nlohmann::json document = published_json(results);
  EXPECT_EQ(document["times"].size(), published_times().size());
  EXPECT_EQ(document["why_apart"].size(), 4u);
  for (const nlohmann::json& time : document["times"]) {
    EXPECT_EQ(time["ours"].size(), 4u) << "two amplitudes, two places of the inverse";
    for (const nlohmann::json& ours : time["ours"]) EXPECT_TRUE(ours["ratio"].is_null());
  }
}

TEST(BenchPublished, NothingKeepsApartWhatRanInFull) {
  Results results = results_of(run_with_the_papers_settings());
  results.runs.clear();
  for (const PublishedData& data : published_data()) {
    for (const FieldAsWritten& field : fields_as_written()) {
      for (const std::string& name : method_names()) {
        bench::Run run = run_with_the_papers_settings();
        run.size.z = data.slices;
        run.field = field.name;
        run.method = parse_method(name);
        results.runs.push_back(run);
      }
    }
  }
  EXPECT_TRUE(why_apart(results).empty());
  EXPECT_EQ(measured(results).size(), 4 * published_times().size());
}

TEST(BenchPublished, AThreadHoldsAsManyBytesOfVerticesAsThePaperSays) { EXPECT_EQ(8 * sizeof(CellVertex), 192u); }

TEST(BenchMethods, OnlyThePapersHaveAFormWithAnInversePerVoxel) {
  for (const std::string& name : method_names()) {
    const Method method = parse_method(name);
    EXPECT_EQ(name_of(method), name);
    if (inverse_of(method) == InverseIn::every_voxel) {
      EXPECT_TRUE(name.ends_with("-per-voxel")) << name;
      EXPECT_THROW(per_voxel(method), InputError);
    } else if (method == Method::gascon || method == Method::tetwarp) {
      EXPECT_THROW(per_voxel(method), InputError);
    } else {
      EXPECT_EQ(name_of(per_voxel(method)), name + "-per-voxel");
      EXPECT_EQ(inverse_of(per_voxel(method)), InverseIn::every_voxel);
    }
  }
}

// Eqs. 14 to 16 in double at t = pi / 2, p in voxels.
TEST(BenchFields, FieldsAsWrittenAreThePapersEquations) {
  const glm::i64vec3 size(41, 37, 33);
  const glm::dvec3 c(20, 18, 16);
  const double t = std::acos(0.0);
  for (const FieldAsWritten& field : fields_as_written()) {
    const Formula formula = make_formula(field.name, size);
    const std::string transform = field.transform;
    for (const glm::dvec3 p :
         {glm::dvec3(3, 5, 7), glm::dvec3(20, 18, 16), glm::dvec3(40, 0, 32), glm::dvec3(0, 18, 0)}) {
      const glm::dvec3 d = p - c;
      glm::dvec3 expected(0);
      if (transform == "wave") {
        expected.x = field.amplitude * std::sin(p.z + t);
      } else if (transform == "twist") {
        const double theta = field.amplitude / (20 * 16) * std::sin(t) * d.z;
        expected = {d.x * std::cos(theta) - d.y * std::sin(theta) - d.x,
                    d.x * std::sin(theta) + d.y * std::cos(theta) - d.y, 0};
      } else if (d != glm::dvec3(0)) {
        expected = field.amplitude * std::sin(t) / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) * d;
      }
      const glm::vec3 found = displacement_at(formula, glm::vec3(p));
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(static_cast<double>(found[axis]), expected[axis], 4e-5) << field.name << axis;
    }
  }
}

TEST(BenchFields, AmplitudesAreTheWayThatAVertexGoes) {
  const glm::i64vec3 size(401, 401, 301);
  for (const FieldAsWritten& field : fields_as_written()) {
    // the first slice of Wave has sin(pi / 2); of Twist the middle of a side, of Bubble any place
    const glm::vec3 way = displacement_at(make_formula(field.name, size), {0, 200, 0});
    const double length = std::sqrt(static_cast<double>(way.x * way.x + way.y * way.y + way.z * way.z));
    EXPECT_NEAR(length, field.amplitude, 0.01 * field.amplitude) << field.name;
  }
}

}  // namespace
}  // namespace tetwarp::bench
