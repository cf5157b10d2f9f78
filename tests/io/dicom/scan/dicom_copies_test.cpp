// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Files that hold one and the same image count once.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <gtest/gtest.h>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_edit.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/dicom/only_series.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

testing::AssertionResult counts_five(const fs::path& folder, const std::vector<std::string>& words) {
  const DicomSeries series = only_series(folder);
  if (series.refusal) return testing::AssertionFailure() << *series.refusal;
  if (series.slices.size() != 5) return testing::AssertionFailure() << series.slices.size() << " slices";
  if (series.warnings.size() != 1) return testing::AssertionFailure() << series.warnings.size() << " warnings";
  return says(series.warnings[0], words);
}

TEST(DicomCopies, CopiesUnderOtherNamesAndInSubFoldersCountOnce) {
  const Scratch folder;
  write_stack(folder.path(), 5);
  fs::create_directories(folder / "backup/again");
  for (int k = 0; k < 5; ++k) {
    const std::string name = std::string("s0") + std::to_string(k) + ".dcm";
    fs::copy_file(folder / name, folder / ("backup/" + name));
  }
  fs::copy_file(folder / "s03.dcm", folder / "backup/again/IM3");
  EXPECT_TRUE(
      counts_five(folder.path(), {"6 identical copies of slices left out", "backup/s00.dcm of ", "and others"}));
  for (const DicomSlice& slice : only_series(folder.path()).slices)
    EXPECT_EQ(slice.file.parent_path(), folder.path()) << "the shortest name is kept";
}

TEST(DicomCopies, WhatAnArchiveChangesBesideTheImageMakesNoOtherImage) {
  const Scratch folder;
  write_stack(folder.path(), 5);
  edit_copy(folder / "s02.dcm", folder / "zzz.dcm", [](DcmDataset& data) {
    data.putAndInsertString(DCM_PatientName, "CORRECTED^NAME");
    data.putAndInsertString(DCM_StudyDescription, "added by the archive");
    data.putAndInsertString(DCM_ImagePositionPatient, "-10.0\\-20.00\\+35.0");
  });
  EXPECT_TRUE(counts_five(folder.path(), {"1 identical copy of a slice left out", "zzz.dcm of ", "s02.dcm"}));
}

TEST(DicomCopies, TheSameImageInAnotherEncodingCountsOnce) {
  DcmRLEEncoderRegistration::registerCodecs();
  const Scratch folder;
  write_stack(folder.path(), 5);
  write_stack(folder / "packed", 5, [](int, MadeSlice& slice) { slice.encoding = EXS_RLELossless; });
  write_stack(folder / "turned", 5, [](int, MadeSlice& slice) { slice.encoding = EXS_BigEndianExplicit; });
  EXPECT_TRUE(counts_five(folder.path(), {"10 identical copies"}));
  DcmRLEEncoderRegistration::cleanup();
}

TEST(DicomCopies, OneUidForTwoImagesIsRefusedWithBothNames) {
  struct Case {
    std::function<void(MadeSlice&)> change;
    std::string word;
  };
  const std::vector<Case> cases = {
      {[](MadeSlice& s) { s.words = {99}; }, "differ in their pixels"},
      {[](MadeSlice& s) { s.position = "-10\\-20\\500"; }, "differ in Image Position"},
      {[](MadeSlice& s) { s.orientation = "0\\1\\0\\0\\0\\-1"; }, "differ in Image Orientation"},
      {[](MadeSlice& s) { s.spacing = "1\\1"; }, "differ in Pixel Spacing"},
      {[](MadeSlice& s) { s.intercept = "0"; }, "the meaning of their pixels"},
      {[](MadeSlice& s) { s.rows = 5; }, "the form"},
  };
  for (const Case& one : cases) {
    const Scratch folder;
    write_stack(folder.path(), 5);
    MadeSlice other;
    other.sop_instance = "1.2.3.3";
    other.position = position_text(-10, -20, 35);
    one.change(other);
    write_slice(folder / "zzz.dcm", other);
    const DicomSeries series = only_series(folder.path());
    EXPECT_TRUE(says(series.refusal.value_or("accepted"),
                     {"SOP Instance UID 1.2.3.3 and ", one.word, "s02.dcm, ", "zzz.dcm", "take away"}));
  }
}

TEST(DicomCopies, ATruncatedCopyIsRefusedAndNotPreferred) {
  const Scratch folder;
  write_stack(folder.path(), 5);
  fs::copy_file(folder / "s02.dcm", folder / "a.dcm");
  fs::resize_file(folder / "a.dcm", fs::file_size(folder / "a.dcm") - 20);
  EXPECT_TRUE(says(only_series(folder.path()).refusal.value_or("accepted"), {"1.2.3.3", "a.dcm", "s02.dcm"}));
}

TEST(DicomCopies, WithoutUidsCopiesAreKnownByTheirBytesAlsoAmongPhases) {
  const Scratch folder;
  for (const char* phase : {"1", "2"}) {
    write_stack(folder / phase, 5, [phase](int, MadeSlice& slice) {
      slice.sop_instance = "";
      slice.words = {static_cast<std::uint16_t>(*phase)};
      slice.edit = [phase](DcmDataset& data) { data.putAndInsertString(DCM_AcquisitionNumber, phase); };
    });
    fs::copy(folder / phase, folder / (std::string("copy of ") + phase));
  }
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 2u);
  for (const DicomSeries& series : scan.series) {
    EXPECT_EQ(series.refusal, std::nullopt);
    EXPECT_EQ(series.slices.size(), 5u);
    ASSERT_EQ(series.warnings.size(), 1u);
    EXPECT_TRUE(says(series.warnings[0], {"10 identical copies"}));
  }
}

TEST(DicomCopies, SlicesOfOneSeriesInTwoOthersStayInBoth) {
  const Scratch folder;
  write_stack(folder / "a", 4);
  write_stack(folder / "b", 4, [](int, MadeSlice& slice) { slice.series = "1.2.3.9"; });
  const DicomScan scan = scan_dicom(folder.path());
  ASSERT_EQ(scan.series.size(), 2u);
  EXPECT_EQ(scan.series[0].slices.size() + scan.series[1].slices.size(), 8u);
}

}  // namespace
}  // namespace tetwarp
