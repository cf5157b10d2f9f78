// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

TEST(DicomFolder, WipedSeriesUidsAreToldApartByFolder) {
  const Scratch folder;
  for (const char* name : {"a", "b"}) {
    write_stack(folder / name, 3, [](int, MadeSlice& slice) { slice.series = ""; });
  }
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 2u);
  EXPECT_EQ(scan.series[0].slices.size(), 3u);
  EXPECT_EQ(scan.series[1].refusal, std::nullopt);
}

TEST(DicomFolder, SeriesComeInOrderOfTheirNumberThenUid) {
  const Scratch folder;
  int number = 3;
  for (const char* uid : {"1.9", "1.8", "1.7"}) {
    write_stack(folder / uid, 2, [&](int, MadeSlice& slice) {
      slice.series = uid;
      slice.series_number = number;
    });
    if (number == 3) number = 2;
  }
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 3u);
  EXPECT_EQ(scan.series[0].series_uid, "1.7");
  EXPECT_EQ(scan.series[1].series_uid, "1.8");
  EXPECT_EQ(scan.series[2].series_uid, "1.9");
}

TEST(DicomFolder, JunkIsSkippedWithTheReason) {
  const Scratch folder;
  write_stack(folder.path(), 3);
  write_file(folder / "a-notes.txt", "not an image at all");
  write_file(folder / "b-empty.log", "");
  write_file(folder / "c-noise", std::string(5000, '\b'));
  fs::create_symlink("nowhere", folder / "d-link");
  ASSERT_EQ(::mkfifo((folder / "e-pipe").c_str(), 0600), 0);
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].refusal, std::nullopt);
  ASSERT_EQ(scan.skipped.size(), 5u);
  EXPECT_TRUE(says(to_string(scan.skipped[0]), {"a-notes.txt: not DICOM"}));
  EXPECT_TRUE(says(to_string(scan.skipped[1]), {"b-empty.log: an empty file"}));
  EXPECT_TRUE(says(to_string(scan.skipped[2]), {"c-noise: not DICOM"}));
  EXPECT_TRUE(says(to_string(scan.skipped[3]), {"d-link: a link that leads nowhere"}));
  EXPECT_TRUE(says(to_string(scan.skipped[4]), {"e-pipe: not a regular file"}));
}

TEST(DicomFolder, AFileThatMayHaveBeenASliceIsNotPassedOver) {
  const std::string preamble(100, '\0');
  for (const std::string& content : {std::string(), preamble}) {
    const Scratch folder;
    write_stack(folder.path(), 3);
    write_file(folder / "s03.dcm", content);
    const DicomScan scan = scan_dicom(folder.path());
    ASSERT_EQ(scan.series.size(), 1u);
    ASSERT_TRUE(scan.series[0].refusal);
    EXPECT_TRUE(says(*scan.series[0].refusal, {"s03.dcm", "it may be a slice"}));
    EXPECT_TRUE(scan_dicom(folder / "s00.dcm").series.at(0).refusal) << "also for the series beside one file";
    EXPECT_EQ(scan_dicom(folder / "s00.dcm", true).series.at(0).refusal, std::nullopt);
  }
}

TEST(DicomFolder, LinksAreFollowedAndEachRealFolderAndFileCountsOnce) {
  const Scratch folder;
  write_stack(folder / "elsewhere", 4);
  fs::create_directories(folder / "in/sub");
  fs::create_directory_symlink(folder / "elsewhere", folder / "in/link");
  fs::create_directory_symlink(folder / "elsewhere", folder / "in/link-again");
  fs::create_directory_symlink("..", folder / "in/sub/loop");
  fs::create_directory_symlink("../..", folder / "in/sub/outwards");
  fs::create_symlink(folder / "elsewhere/s01.dcm", folder / "in/s01.dcm");
  const DicomScan scan = scan_dicom(folder / "in");
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].slices.size(), 4u);
  EXPECT_EQ(scan.series[0].warnings, std::vector<std::string>());
  ASSERT_EQ(scan.skipped.size(), 1u);
  EXPECT_TRUE(says(to_string(scan.skipped[0]), {"outwards", "holds the input"}));
}

TEST(DicomFolder, OneFileFindsItsSeriesBesideItAndNoOther) {
  const Scratch folder;
  write_stack(folder.path(), 4);
  write_stack(folder / "sub", 2, [](int, MadeSlice& slice) { slice.position = "-10\\-20\\500"; });
  MadeSlice other;
  other.series = "9.9";
  write_slice(folder / "other.dcm", other);
  write_file(folder / "notes.txt", "text");
  const DicomScan scan = scan_dicom(folder / "s02.dcm");
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].slices.size(), 4u);
  EXPECT_TRUE(scan.skipped.empty());
}

TEST(DicomFolder, SingleReadsThatFileAlone) {
  const Scratch folder;
  write_stack(folder.path(), 4);
  const DicomScan scan = scan_dicom(folder / "s02.dcm", true);
  ASSERT_EQ(scan.series.size(), 1u);
  ASSERT_EQ(scan.series[0].slices.size(), 1u);
  EXPECT_EQ(scan.series[0].slices[0].file, folder / "s02.dcm");
}

TEST(DicomFolder, MissingPathIsAnError) {
  const Scratch folder;
  EXPECT_THROW(scan_dicom(folder / "absent"), InputError);
}

TEST(DicomFolder, StopIsHonouredAndProgressRises) {
  const Scratch folder;
  write_stack(folder.path(), 5);
  std::vector<double> progress;
  scan_dicom(folder.path(), false, {.progress = [&](double done) { progress.push_back(done); }});
  EXPECT_EQ(progress, (std::vector<double>{0.2, 0.4, 0.6, 0.8, 1.0}));
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(scan_dicom(folder.path(), false, {.stop = stop.get_token()}), Cancelled);
}

}  // namespace
}  // namespace tetwarp
