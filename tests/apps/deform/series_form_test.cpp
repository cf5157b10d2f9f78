// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What the command line chooses of a derived series.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

TEST(SeriesForm, IsThatOfTheOptionsAndStandsInTheSidecar) {
  const Scratch scratch;
  write_stack(scratch / "in", 4, [](int, MadeSlice& slice) { slice.frame = "1.2.5"; });
  const Outcome run = run_tetwarp(scratch.path(),
                                  "deform in -f translate:by=1/0/0 --outside rest -o out --transfer-syntax jpeg-ls "
                                  "--keep-frame-of-reference --series-number 17 --series-description mine");
  ASSERT_EQ(run.status, 0) << run.err;
  const DicomSeries series = scan_dicom(scratch / "out").series.at(0);
  EXPECT_EQ(series.slices.at(0).transfer_syntax_uid, "1.2.840.10008.1.2.4.80");
  EXPECT_EQ(series.frame_of_reference_uid, "1.2.5");
  EXPECT_EQ(series.series_number, 17);
  EXPECT_EQ(series.description, "mine");
  std::ifstream file(scratch / "out.json");
  const nlohmann::json said = nlohmann::json::parse(file)["options"]["dicom"];
  EXPECT_EQ(said["transfer_syntax"], "jpeg-ls");
  EXPECT_EQ(said["keep_frame_of_reference"], true);
  EXPECT_EQ(said["series_number"], 17);
  EXPECT_EQ(said["series_description"], "mine");
}

TEST(SeriesForm, IsForASeriesOnly) {
  const Scratch scratch;
  write_stack(scratch / "in", 4);
  for (const char* option :
       {"--transfer-syntax rle", "--keep-frame-of-reference", "--series-number 2", "--series-description x"}) {
    const Outcome run = run_tetwarp(scratch.path(), std::string("deform in -f identity -o out.nii ") + option);
    EXPECT_EQ(run.status, 2) << option;
    EXPECT_TRUE(says(run.err, {"for a DICOM series", "out.nii"}));
  }
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in -f identity -o out --transfer-syntax lossy").status, 2);
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in -f identity -o out --series-number -1").status, 2);
}

TEST(SeriesForm, ADescriptionThatCannotBeWrittenLeavesNothingBehind) {
  const Scratch scratch;
  write_stack(scratch / "in", 4);
  const Outcome run =
      run_tetwarp(scratch.path(), "deform in -f identity -o out --series-description " + std::string(65, 'x'));
  EXPECT_EQ(run.status, 4);
  EXPECT_TRUE(says(run.err, {"65 characters", "at most 64"}));
  EXPECT_FALSE(std::filesystem::exists(scratch / "out"));
}

}  // namespace
}  // namespace tetwarp::test
