// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The floors of `itk`, from given times, errors and memory.
#include "bench/itk/itk.h"

#include <gtest/gtest.h>

#include "tests/support/floors.h"

namespace tetwarp::bench {
namespace {

using test::expect_floor;
using test::find_floor;

Json run_of(const std::string& task, std::size_t contender, std::int64_t cell_size, double median, double rms) {
  const ItkContender& by = itk_task(task).contenders.at(contender);
  return {{"task", task},  {"field", "elastic"},        {"cell_size", cell_size}, {"filters", by.filters},
          {"own", by.own}, {"ms", summarize({median})}, {"error", {{"rms", rms}}}};
}

Json results_of(const std::vector<Json>& runs, const std::vector<Json>& streams = {}) {
  return {{"runs", runs}, {"streams", streams}};
}

TEST(ItkFloors, EachOfItksFiltersIsHeldAgainstOursOnTheSameField) {
  const Floors floors = find_itk_floors(
      results_of({run_of("pull", 0, 1, 100, 0.5), run_of("pull", 1, 1, 250, 0.25), run_of("pull", 2, 1, 80, 1),
                  run_of("pull", 0, 4, 10, 2), run_of("pull", 2, 4, 40, 1)}));
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
  const Floors floors =
      find_itk_floors(results_of({run_of("transform", 0, 2, 100, 1e-7), run_of("transform", 1, 2, 90, 1e-7),
                                  run_of("determinant", 0, 1, 100, 0.01), run_of("determinant", 1, 1, 400, 0.001)}));
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
  std::vector<Json> streams;
  for (const int pieces : {1, 16}) {
    for (const ItkContender& by : itk_task("stream").contenders)
      streams.push_back({{"filters", by.filters},
                         {"own", by.own},
                         {"pieces", pieces},
                         {"peak_bytes_beyond_field", pieces == 1 ? 1000 : 600},
                         {"differing_bytes", pieces == 1 ? 0 : 7}});
  }
  const Floors floors = find_itk_floors(results_of({}, streams));
  const std::string ours = "VertexFieldResampleImageFilter, 16 pieces", itks = "WarpImageFilter, 16 pieces";
  expect_floor(floors, "bytes that differ from the whole", ours, 7, 0, false);
  expect_floor(floors, "bytes that differ from the whole", itks, 7, std::nullopt, std::nullopt);
  expect_floor(floors, "memory / that of the whole", ours, 0.6, 0.5, false);
  expect_floor(floors, "memory / that of the whole", itks, 0.6, std::nullopt, std::nullopt);
  EXPECT_FALSE(find_floor(floors, "memory / that of the whole", "VertexFieldResampleImageFilter, 1 pieces"));
}

}  // namespace
}  // namespace tetwarp::bench
