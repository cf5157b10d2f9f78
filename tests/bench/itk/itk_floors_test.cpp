// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `itk`, from given times, errors and memory, and what is written of them.
#include "bench/itk/itk_floors.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bench/itk/itk_report.h"
#include "tests/support/floors.h"
#include "tests/support/says.h"

namespace tetwarp::bench {
namespace {

using test::expect_floor;
using test::find_floor;

Summary ms(double median) { return {median, median, median, median, median, 3}; }

ItkRun run_of(const std::string& task, std::size_t contender, std::int64_t cell_size, double median, double rms) {
  return {.task = task,
          .field = "elastic",
          .cell_size = cell_size,
          .by = itk_task(task).contenders.at(contender),
          .ms = ms(median),
          .cpu_ms = ms(2 * median),
          .input_bytes = 100000000,
          .output_bytes = 40000000,
          .peak_bytes = 50000000,
          .deviation = Deviation{rms, rms, 2 * rms, 1000, 0}};
}

ItkResults results_of(const std::vector<ItkRun>& runs, const std::vector<ItkStream>& streams = {}) {
  return {.options = {}, .machine = {}, .itk = "5.2.1", .runs = runs, .streams = streams};
}

TEST(ItkFloors, EachOfItksFiltersIsHeldAgainstOursOnTheSameField) {
  const std::vector<Floor> floors =
      find_floors(results_of({run_of(kPull, 0, 1, 100, 0.5), run_of(kPull, 1, 1, 250, 0.25), run_of(kPull, 2, 1, 80, 1),
                              run_of(kPull, 0, 4, 10, 2), run_of(kPull, 2, 4, 40, 1)}));
  ASSERT_EQ(floors.size(), 6u);
  const std::string where = "warp, the inverse field is given, elastic, cells of ", warp = ", WarpImageFilter",
                    resample = ", ResampleImageFilter, DisplacementFieldTransform";
  expect_floor(floors, "time / tetwarp's", where + "1" + resample, 2.5, 1, true);
  expect_floor(floors, "rms error / tetwarp's", where + "1" + resample, 0.5, 0.99, false);
  expect_floor(floors, "time / tetwarp's", where + "1" + warp, 0.8, 1, false);
  expect_floor(floors, "rms error / tetwarp's", where + "1" + warp, 2, 0.99, true);
  expect_floor(floors, "time / tetwarp's", where + "4" + warp, 4, 1, true);
  expect_floor(floors, "rms error / tetwarp's", where + "4" + warp, 0.5, std::nullopt, std::nullopt);
  EXPECT_FALSE(all_met(floors));
}

TEST(ItkFloors, NothingIsRequiredOfWhatIsTheSameWorkOrAnotherTruth) {
  const std::vector<Floor> floors =
      find_floors(results_of({run_of(kTransform, 0, 2, 100, 1e-7), run_of(kTransform, 1, 2, 90, 1e-7),
                              run_of(kDeterminant, 0, 1, 100, 0.01), run_of(kDeterminant, 1, 1, 400, 0.001)}));
  int required = 0, aims = 0;
  for (const Floor& floor : floors) {
    required += floor.required.has_value();
    aims += floor.aim.has_value();
  }
  EXPECT_EQ(floors.size(), 4u);
  EXPECT_EQ(required, 0);
  EXPECT_EQ(aims, 1) << "the time of determinants";
  EXPECT_TRUE(all_met(floors));
}

TEST(ItkFloors, OurStreamsMayNeitherWriteOtherBytesNorNeedAsMuchMemory) {
  const auto& contenders = itk_task(kStream).contenders;
  std::vector<ItkStream> streams;
  for (const int pieces : {1, 16}) {
    for (const ItkContender& by : contenders)
      streams.push_back({.by = by,
                         .divisions = pieces,
                         .ms = ms(10),
                         .cpu_ms = ms(10),
                         .peak_bytes = pieces == 1 ? 1000u : 600u,
                         .differing_bytes = pieces == 1 ? 0u : 7u});
  }
  const std::vector<Floor> floors = find_floors(results_of({}, streams));
  const std::string ours = "VertexFieldResampleImageFilter, 16 pieces", itks = "WarpImageFilter, 16 pieces";
  expect_floor(floors, "bytes that differ from the whole", ours, 7, 0, false);
  expect_floor(floors, "bytes that differ from the whole", itks, 7, std::nullopt, std::nullopt);
  expect_floor(floors, "memory / that of the whole", ours, 0.6, 0.5, false);
  expect_floor(floors, "memory / that of the whole", itks, 0.6, std::nullopt, std::nullopt);
  EXPECT_FALSE(find_floor(floors, "memory / that of the whole", "VertexFieldResampleImageFilter, 1 pieces"));
}

TEST(ItkReport, ALineHoldsBothSidesAndSaysWhatTheOutputTakes) {
  const ItkResults results = results_of({run_of(kPull, 0, 1, 100, 0.29), run_of(kPull, 2, 1, 2500, 0.58)});
  const std::vector<Floor> floors = find_floors(results);
  EXPECT_TRUE(
      says(to_markdown(results, floors),
           {"| WarpImageFilter | PullFieldResampleImageFilter | elastic, 1 | 2.50 / 0.100 | 25 | 50 / 50 (40) | "
            "0.58, 1.2 / 0.29, 0.58 HU |",
            "| elastic, 1 | WarpImageFilter | 2500.0 (2500.0-2500.0) |"}));
  const nlohmann::json run = to_json(results, floors)["runs"][1];
  EXPECT_EQ(run["peak_bytes_beyond_inputs"], 50000000);
  EXPECT_EQ(run["error"]["unit"], "HU");
  EXPECT_EQ(run["own"], false);
}

}  // namespace
}  // namespace tetwarp::bench
