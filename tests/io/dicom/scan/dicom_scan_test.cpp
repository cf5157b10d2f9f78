// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <cmath>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/dicom/only_series.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

std::string refusal_of(const fs::path& folder) { return only_series(folder).refusal.value_or("accepted"); }

void set_z(MadeSlice& slice, const std::string& z) { slice.position = "-10\\-20\\" + z; }

TEST(DicomScan, GeometryComesFromPositionOrientationAndPixelSpacing) {
  const Scratch folder;
  write_stack(folder.path(), 5);
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.geometry.size, glm::i64vec3(6, 4, 5));
  EXPECT_EQ(series.geometry.spacing, glm::dvec3(0.5, 0.75, 2.5));
  EXPECT_EQ(series.geometry.origin, glm::dvec3(-10, -20, 30));
  EXPECT_EQ(series.geometry.direction, glm::dmat3(1));
  EXPECT_EQ(series.warnings, std::vector<std::string>());
}

TEST(DicomScan, SliceLocationThicknessAndSpacingBetweenSlicesAreNoGeometry) {
  const Scratch folder;
  write_stack(folder.path(), 4, [](int k, MadeSlice& slice) {
    slice.edit = [k](DcmDataset& data) {
      data.putAndInsertString(DCM_SliceLocation, std::to_string(100 - 7 * k).c_str());
      data.putAndInsertString(DCM_SliceThickness, "9");
      data.putAndInsertString(DCM_SpacingBetweenSlices, "-4");
    };
  });
  EXPECT_EQ(only_series(folder.path()).geometry.spacing.z, 2.5);
}

TEST(DicomScan, SlicesAreSortedAlongTheNormalWhateverTheirNumbersAndNames) {
  const Scratch folder;
  write_stack(folder.path(), 6, [](int k, MadeSlice& slice) { set_z(slice, std::to_string((k * 5) % 6 * 2)); });
  const DicomSeries series = only_series(folder.path());
  ASSERT_EQ(series.slices.size(), 6u);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(series.slices[k].position_mm, 2 * k);
  EXPECT_EQ(series.slices[1].instance_number, 6);
}

TEST(DicomScan, NormalIsRowTimesColumn) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int k, MadeSlice& slice) {
    slice.orientation = "0\\1\\0\\0\\0\\-1";  // sagittal, normal -x
    slice.position = std::to_string(100 - 3 * k) + "\\5\\6";
  });
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.geometry.origin, glm::dvec3(100, 5, 6));
  EXPECT_EQ(series.geometry.direction[2], glm::dvec3(-1, 0, 0));
  EXPECT_EQ(series.geometry.spacing.z, 3);
}

TEST(DicomScan, RoundedOrientationBecomesARotationAndIsTold) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int, MadeSlice& slice) {
    slice.orientation = ".707\\.707\\0\\-.707\\.707\\0";
    slice.rows = slice.columns = 300;
  });
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_NEAR(series.geometry.direction[0].x, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(series.geometry.direction[1].x, -std::sqrt(0.5), 1e-15);
  ASSERT_EQ(series.warnings.size(), 1u);
  EXPECT_TRUE(says(series.warnings[0], {"Image Orientation is rounded"}));
}

TEST(DicomScan, OrientationThatIsNoRotationIsRefused) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int, MadeSlice& slice) { slice.orientation = "1\\0\\0\\0.1\\1\\0"; });
  EXPECT_TRUE(says(refusal_of(folder.path()), {"(0020,0037)", "no rotation", "s00.dcm", "0.1"}));
}

/// How the slice distances of a usable series differ; "even" where they do not.
std::string uneven_of(const fs::path& folder) {
  const DicomSeries series = only_series(folder);
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.uneven.has_value(), !series.geometry.slices.empty());
  return series.uneven.value_or("even");
}

TEST(DicomScan, MissingSliceIsNamedWithItsNeighboursAndTheOthersArePlaced) {
  const Scratch folder;
  write_stack(folder.path(), 8);
  fs::remove(folder / "s04.dcm");
  EXPECT_TRUE(says(uneven_of(folder.path()),
                   {"slice gap 5 mm between ", "s03.dcm and ", "s05.dcm, 2.5 mm elsewhere", "(1 slice missing)"}));
  const Geometry geometry = only_series(folder.path()).geometry;
  EXPECT_EQ(geometry.slices, (std::vector<double>{0, 2.5, 5, 7.5, 12.5, 15, 17.5}));
  EXPECT_EQ(geometry.spacing.z, 17.5 / 6);
  require_valid(geometry, "stack");
}

TEST(DicomScan, SlicesAreUnevenFromOneThousandthOfTheirDistance) {
  const Scratch folder;
  for (const auto& [z, is_even] : {std::pair{"35.002", true}, {"35.006", false}, {"35.1", false}}) {
    write_stack(folder.path(), 5, [&, at = z](int k, MadeSlice& slice) {
      if (k == 2) set_z(slice, at);
    });
    EXPECT_EQ(uneven_of(folder.path()) == "even", is_even) << z << ": " << uneven_of(folder.path());
  }
}

TEST(DicomScan, PositionsWrittenWithTwoDecimalsAreEven) {
  const Scratch folder;
  const char* z[] = {"0.00", "0.63", "1.25", "1.88", "2.50", "3.13", "3.75"};
  write_stack(folder.path(), 7, [&](int k, MadeSlice& slice) { set_z(slice, z[k]); });
  EXPECT_EQ(uneven_of(folder.path()), "even");
}

TEST(DicomScan, GapsThatDriftWithinToleranceAreUneven) {
  const Scratch folder;
  write_stack(folder.path(), 60, [&](int k, MadeSlice& slice) {
    set_z(slice, std::to_string(k < 30 ? k * 1.0 : 29 + (k - 29) * 1.0015));
  });
  EXPECT_TRUE(says(uneven_of(folder.path()), {"slice gap"}));
  write_stack(folder.path(), 60, [&](int k, MadeSlice& slice) {
    set_z(slice, std::to_string(k < 30 ? k * 1.0 : 29 + (k - 29) * 1.0009));
  });
  EXPECT_TRUE(says(uneven_of(folder.path()), {"drift", "expected", "found"}));
}

TEST(DicomScan, GantryTiltLeansTheStackAsPositionsSay) {
  const Scratch folder;
  write_stack(folder.path(), 5, [](int, MadeSlice& slice) { slice.orientation = "1\\0\\0\\0\\0.9483237\\-0.3173047"; });
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.uneven, std::nullopt);
  // The way that the table moved, which is not the normal.
  EXPECT_EQ(series.geometry.direction[2], glm::dvec3(0, 0, 1));
  EXPECT_NEAR(series.geometry.direction[1].y, 0.9483237, 1e-7);
  EXPECT_NEAR(series.geometry.spacing.z, 2.5, 1e-12);
  ASSERT_EQ(series.warnings.size(), 1u);
  EXPECT_TRUE(says(series.warnings[0], {"gantry tilt", "18.5 degrees"}));
}

TEST(DicomScan, SlicesBesideOneLineAreRefusedByName) {
  const Scratch folder;
  write_stack(folder.path(), 5, [](int k, MadeSlice& slice) {
    if (k == 2) slice.position = "-10\\-19\\35";
  });
  EXPECT_TRUE(says(refusal_of(folder.path()), {"not stacked on one line", "s02.dcm", "1 mm beside"}));
  write_stack(folder.path(), 5, [](int k, MadeSlice& slice) {
    slice.position = "-10\\" + std::to_string(-20 + 9 * k) + "\\" + std::to_string(30 + 2 * k);
  });
  EXPECT_TRUE(says(refusal_of(folder.path()), {"77.47", "degrees beside their normal", "less than 60"}));
}

TEST(DicomScan, SlicesAtOnePositionAreRefusedByName) {
  const Scratch folder;
  write_stack(folder.path(), 4, [](int, MadeSlice& slice) { set_z(slice, "61.5"); });
  EXPECT_TRUE(says(refusal_of(folder.path()), {"4 slices at the same position -10\\-20\\61.5", "s00.dcm", "s03.dcm"}));
}

TEST(DicomScan, IdenticalCopyIsCountedOnceAndTold) {
  const Scratch folder;
  write_stack(folder.path(), 4);
  fs::copy_file(folder / "s02.dcm", folder / "copy of s02.dcm");
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.slices.size(), 4u);
  ASSERT_EQ(series.warnings.size(), 1u);
  EXPECT_TRUE(says(series.warnings[0], {"1 identical", "s02.dcm"}));
}

TEST(DicomScan, RetakeOfASliceIsRefused) {
  const Scratch folder;
  write_stack(folder.path(), 5, [](int k, MadeSlice& slice) {
    if (k < 4) return;
    slice = MadeSlice();
    slice.words = {77};
    slice.sop_instance = "1.2.3.99";
    set_z(slice, std::to_string(30.0));
  });
  EXPECT_TRUE(says(refusal_of(folder.path()), {"2 slices at the same position", "s00.dcm", "s04.dcm"}));
}

TEST(DicomScan, MixedSlicesAreRefusedWithBothValues) {
  struct Case {
    std::function<void(MadeSlice&)> change;
    std::vector<std::string> words;
  };
  const std::vector<Case> cases = {
      {[](MadeSlice& s) { s.rows = 5; }, {"Rows x Columns", "4 x 6 in ", "5 x 6 in ", "s02.dcm"}},
      {[](MadeSlice& s) { s.spacing = "0.75\\0.51"; }, {"Pixel Spacing", "0.75\\0.5 in ", "0.75\\0.51 in "}},
      {[](MadeSlice& s) { s.frame = "1.2.5"; }, {"Frame of Reference UID", "1.2.4 in ", "1.2.5 in "}},
      {[](MadeSlice& s) { s.study = "1.9"; }, {"Study Instance UID", "1.2 in ", "1.9 in "}},
  };
  for (const Case& one : cases) {
    const Scratch folder;
    write_stack(folder.path(), 4, [&](int k, MadeSlice& slice) {
      if (k == 2) one.change(slice);
    });
    EXPECT_TRUE(says(refusal_of(folder.path()), one.words));
  }
}

TEST(DicomScan, ScoutOfAnotherOrientationIsSetAside) {
  const Scratch folder;
  write_stack(folder.path(), 5, [](int k, MadeSlice& slice) {
    if (k == 0) slice.orientation = "1\\0\\0\\0\\0\\-1";
  });
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.geometry.size.z, 4);
  ASSERT_EQ(series.set_aside.size(), 1u);
  EXPECT_TRUE(says(to_string(series.set_aside[0]),
                   {"s00.dcm: coronal among axial slices", "Image Orientation 1\\0\\0\\0\\0\\-1", "1\\0\\0\\0\\1\\0"}));
}

TEST(DicomScan, OrientationsWithoutClearMajorityAreRefused) {
  const Scratch folder;
  write_stack(folder.path(), 6, [](int k, MadeSlice& slice) {
    if (k < 2) slice.orientation = "1\\0\\0\\0\\0\\-1";
  });
  EXPECT_TRUE(
      says(refusal_of(folder.path()), {"mixed orientations", "s00.dcm", "s02.dcm", "2 orientations in 6 files"}));
}

TEST(DicomScan, LocalizerIsSetAsideByItsImageType) {
  const Scratch folder;
  write_stack(folder.path(), 5, [](int k, MadeSlice& slice) {
    if (k == 4) slice.image_type = "ORIGINAL\\PRIMARY\\LOCALIZER";
  });
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.refusal, std::nullopt);
  ASSERT_EQ(series.set_aside.size(), 1u);
  EXPECT_TRUE(says(to_string(series.set_aside[0]), {"s04.dcm", "localizer"}));
}

TEST(DicomScan, ObjectsThatAreNoCtAreRefusedByTheirKind) {
  for (const auto& [uid, name] : {std::pair{UID_MRImageStorage, "MRImageStorage"},
                                  {UID_EnhancedMRImageStorage, "MR images"},
                                  {UID_SecondaryCaptureImageStorage, "SecondaryCapture"},
                                  {UID_RTDoseStorage, "RTDoseStorage"}}) {
    const Scratch folder;
    write_stack(folder.path(), 2, [sop = uid](int, MadeSlice& slice) { slice.sop_class = sop; });
    EXPECT_TRUE(says(refusal_of(folder.path()), {"no CT slice", name, uid, "(2 files)"}));
  }
}

TEST(DicomScan, AttributesThatMakeAVolumeWrongAreRefusedByTag) {
  const auto remove = [](const DcmTagKey& tag) { return [tag](DcmDataset& data) { data.findAndDeleteElement(tag); }; };
  const auto put = [](const DcmTagKey& tag, const char* value) {
    return [tag, value](DcmDataset& data) { data.putAndInsertString(tag, value); };
  };
  const auto put_word = [](const DcmTagKey& tag, Uint16 value) {
    return [tag, value](DcmDataset& data) { data.putAndInsertUint16(tag, value); };
  };
  const std::vector<std::pair<std::function<void(DcmDataset&)>, std::vector<std::string>>> cases = {
      {remove(DCM_ImagePositionPatient), {"Image Position (0020,0032)", "missing"}},
      {put(DCM_ImagePositionPatient, "1\\2"), {"Image Position (0020,0032)", "three numbers"}},
      {remove(DCM_ImageOrientationPatient), {"Image Orientation (0020,0037)"}},
      {put(DCM_PixelSpacing, "0.5\\0"), {"Pixel Spacing (0028,0030)", "from 1e-6 to 1e6 mm"}},
      {put(DCM_PixelSpacing, "1e-9\\0.5"), {"Pixel Spacing (0028,0030)", "from 1e-6 to 1e6 mm"}},
      {put(DCM_PixelSpacing, "0.5\\1e9"), {"Pixel Spacing (0028,0030)", "from 1e-6 to 1e6 mm"}},
      {remove(DCM_RescaleIntercept), {"Rescale Intercept (0028,1052)"}},
      {put(DCM_RescaleSlope, "0"), {"Rescale Slope (0028,1053)", "other than 0"}},
      {[](DcmDataset& data) { data.insertEmptyElement(DCM_ModalityLUTSequence); },
       {"Modality LUT Sequence (0028,3000)", "Rescale Slope and Intercept alone"}},
      {put(DCM_NumberOfFrames, "3"), {"Number of Frames (0028,0008)", "expected 1, found 3"}},
      {put_word(DCM_SamplesPerPixel, 3), {"Samples per Pixel (0028,0002)", "expected 1, found 3"}},
      {put_word(DCM_BitsAllocated, 32), {"Bits Allocated (0028,0100)", "found 32"}},
      {put_word(DCM_BitsStored, 17), {"Bits Stored (0028,0101)", "found 17"}},
      {put_word(DCM_HighBit, 16), {"High Bit (0028,0102)", "found 16"}},
      {put_word(DCM_Rows, 65535), {"Rows x Columns", "found 65535 x 6"}},
      {put_word(DCM_Rows, 8), {"Pixel Data is truncated", "expected 96 bytes, found 48"}},
      {remove(DCM_PixelData), {"Pixel Data (7FE0,0010) is missing"}},
  };
  for (const auto& [edit, words] : cases) {
    const Scratch folder;
    write_stack(folder.path(), 3, [&, change = edit](int k, MadeSlice& slice) {
      if (k == 1) slice.edit = change;
    });
    EXPECT_TRUE(says(refusal_of(folder.path()), words));
    EXPECT_TRUE(says(refusal_of(folder.path()), {"s01.dcm", ";"}));
  }
}

TEST(DicomScan, HeaderCutShortIsRefusedNotSkipped) {
  const Scratch folder;
  write_stack(folder.path(), 4);
  fs::resize_file(folder / "s03.dcm", fs::file_size(folder / "s03.dcm") - 120);
  EXPECT_TRUE(says(refusal_of(folder.path()), {"damaged file", "s03.dcm"}));
}

TEST(DicomScan, RefusalsNeverHoldTheName) {
  const Scratch folder;
  write_stack(folder.path(), 4, [](int, MadeSlice& slice) { set_z(slice, "61.5"); });
  const DicomSeries series = only_series(folder.path());
  ASSERT_TRUE(series.refusal);
  EXPECT_EQ(series.refusal->find("SECRET"), std::string::npos);
  EXPECT_EQ(series.refusal->find('\n'), std::string::npos);
}

TEST(DicomScan, LoneSliceTakesItsThicknessAsSpacingAndSaysSo) {
  const Scratch folder;
  write_stack(folder.path(), 1, [](int, MadeSlice& slice) {
    slice.edit = [](DcmDataset& data) { data.putAndInsertString(DCM_SliceThickness, "3"); };
  });
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.geometry.spacing.z, 3);
  ASSERT_EQ(series.warnings.size(), 1u);
  EXPECT_TRUE(says(series.warnings[0], {"one slice only", "(0018,0050)"}));
}

TEST(DicomScan, WithoutSopClassCtIsKnownByModalityAndPlace) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int, MadeSlice& slice) {
    slice.edit = [](DcmDataset& data) {
      data.putAndInsertString(DCM_SOPClassUID, "");
      data.putAndInsertString(DCM_SOPInstanceUID, "");
    };
    slice.series = "";
  });
  const DicomSeries series = only_series(folder.path());
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.series_uid, "");
}

TEST(DicomScan, PaddingThatDiffersIsTold) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int k, MadeSlice& slice) {
    slice.edit = [k](DcmDataset& data) {
      data.putAndInsertSint16(DCM_PixelPaddingValue, static_cast<Sint16>(k == 2 ? -1500 : -2000));
    };
  });
  const DicomSeries series = only_series(folder.path());
  ASSERT_EQ(series.warnings.size(), 1u);
  EXPECT_TRUE(says(series.warnings[0], {"Pixel Padding Value differs", "-3024 to -3024 HU", "s00.dcm"}));
}

}  // namespace
}  // namespace tetwarp
