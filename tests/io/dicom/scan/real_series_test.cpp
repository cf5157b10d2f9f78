// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "io/dicom_series.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

/// Facts of a series that other tools agree on.
struct Facts {
  glm::i64vec3 size;
  glm::dvec3 spacing, origin;
  int hu_min, hu_max;
  std::int64_t stored_sum, intercept;
};

std::int64_t sum_of(const DicomVolume& loaded) {
  return std::accumulate(loaded.volume.voxels.begin(), loaded.volume.voxels.end(), std::int64_t{0});
}

void expect_near(const glm::dvec3& actual, const glm::dvec3& expected) {
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(actual[axis], expected[axis], 1e-9) << "axis " << axis;
}

DicomVolume expect_facts(const DicomSeries& series, const Facts& facts) {
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.geometry.size, facts.size);
  expect_near(series.geometry.spacing, facts.spacing);
  expect_near(series.geometry.origin, facts.origin);
  DicomVolume loaded = load_dicom(series);
  const auto [low, high] = std::minmax_element(loaded.volume.voxels.begin(), loaded.volume.voxels.end());
  EXPECT_EQ(*low, facts.hu_min);
  EXPECT_EQ(*high, facts.hu_max);
  EXPECT_EQ(sum_of(loaded), facts.stored_sum + facts.intercept * facts.size.x * facts.size.y * facts.size.z);
  EXPECT_EQ(loaded.rounded, 0u);
  return loaded;
}

testing::AssertionResult is_refused(const DicomScan& scan, const std::vector<std::string>& words) {
  if (scan.series.size() != 1) return testing::AssertionFailure() << scan.series.size() << " series";
  if (!scan.series[0].refusal) return testing::AssertionFailure() << "accepted";
  return says(*scan.series[0].refusal, words);
}

TEST(RealSeries, ChestReadsWithSignedPaddingThatIsWrittenUnsigned) {
  TETWARP_REAL_DATA(folder, "chest-cmb-crc");
  const DicomScan scan = scan_dicom(folder);
  ASSERT_EQ(scan.series.size(), 1u);
  const DicomVolume loaded = expect_facts(
      scan.series[0],
      {{512, 512, 100}, {0.898438, 0.898438, 2.5}, {-228.8, -220, -236.5}, -3024, 3071, -2997318025, -1024});
  ASSERT_TRUE(loaded.padding);
  EXPECT_EQ(loaded.padding->low, -3024);
  EXPECT_EQ(loaded.padding->high, -3024);
  EXPECT_EQ(scan.series[0].geometry.direction, glm::dmat3(1));
  EXPECT_EQ(scan.series[0].slices.front().instance_number, 100);
}

TEST(RealSeries, AbdomenSpacingIsTheDistanceNotTheThickness) {
  TETWARP_REAL_DATA(folder, "abdomen-acrin-flt");
  const DicomScan scan = scan_dicom(folder);
  ASSERT_EQ(scan.series.size(), 1u);
  const DicomVolume loaded = expect_facts(
      scan.series[0],
      {{512, 512, 99}, {0.976562, 0.976562, 4.25}, {-250, -250, -846.25}, -3024, 1288, -2410082677, -1024});
  ASSERT_TRUE(loaded.padding);
  EXPECT_EQ(loaded.padding->low, -3024);
}

TEST(RealSeries, ExamOfAHeadPhantomGivesTwoVolumesAndNamesTheRest) {
  TETWARP_REAL_DATA(folder, "head-phantom-multiseries");
  const DicomScan scan = scan_dicom(folder);
  ASSERT_EQ(scan.series.size(), 4u);
  EXPECT_TRUE(says(scan.series[0].refusal.value_or(""), {"localizer"}));
  expect_facts(scan.series[1],
               {{512, 512, 28}, {0.451171875, 0.451171875, 5}, {-115.5, -1.85, 696.21}, -1024, 782, 1419514858, -1024});
  expect_facts(
      scan.series[2],
      {{512, 512, 140}, {0.451171875, 0.451171875, 1}, {-115.5, -1.85, 694.21}, -1024, 1033, 7090261909, -1024});
  EXPECT_TRUE(says(scan.series[3].refusal.value_or(""), {"SecondaryCaptureImageStorage", "6 files"}));
  EXPECT_EQ(scan.skipped.size(), 5u);
  for (const LeftOutFile& one : scan.skipped) EXPECT_TRUE(says(to_string(one), {"DIRFILE", "directory"}));
}

TEST(RealSeries, SagittalSeriesReadsWithoutItsScout) {
  TETWARP_REAL_DATA(folder, "sagittal-with-scout");
  const DicomScan scan = scan_dicom(folder);
  ASSERT_EQ(scan.series.size(), 1u);
  const DicomSeries& series = scan.series[0];
  expect_facts(
      series,
      {{512, 512, 19}, {0.703125, 0.703125, 3}, {227.848434, -174.726562, 32.627502}, -1024, 3069, 1823840705, -1024});
  EXPECT_EQ(series.geometry.direction, glm::dmat3(0, 1, 0, 0, 0, -1, -1, 0, 0));
  ASSERT_EQ(series.set_aside.size(), 1u);
  EXPECT_TRUE(says(to_string(series.set_aside[0]), {"1-001.dcm", "Image Orientation"}));
}

TEST(RealSeries, OverlappingSlicesReadAndTheTopogramIsRefused) {
  TETWARP_REAL_DATA(folder, "overlap-kits-and-topogram");
  const DicomScan scan = scan_dicom(folder / "kits-00072");
  ASSERT_EQ(scan.series.size(), 1u);
  expect_facts(scan.series[0], {{512, 512, 18},
                                {0.6640625, 0.6640625, 2.5},
                                {-166.66796875, -332.66796875, -48.5},
                                -1024,
                                1334,
                                2417220600,
                                -1024});
  EXPECT_TRUE(is_refused(scan_dicom(folder / "topogram"), {"localizer", "1-1.dcm"}));
}

TEST(RealSeries, CtBesideDoseAndStructuresIsTheOneVolume) {
  TETWARP_REAL_DATA(folder, "rt-breast");
  const DicomScan scan = scan_dicom(folder);
  ASSERT_EQ(scan.series.size(), 2u);
  const auto usable = [](const DicomSeries& series) { return !series.refusal; };
  const auto ct = std::find_if(scan.series.begin(), scan.series.end(), usable);
  ASSERT_EQ(std::count_if(scan.series.begin(), scan.series.end(), usable), 1);
  EXPECT_EQ(ct->geometry.size, glm::i64vec3(512, 512, 1));
  expect_near(ct->geometry.origin, {-275, -524, 168.5593});
  const DicomVolume loaded = load_dicom(*ct);
  EXPECT_EQ(*std::min_element(loaded.volume.voxels.begin(), loaded.volume.voxels.end()), -1000);
  EXPECT_EQ(sum_of(loaded), -210494566);
  ASSERT_EQ(scan.skipped.size(), 2u);
  EXPECT_TRUE(says(to_string(scan.skipped[0]), {"rtplan.dcm", "RTPlanStorage"}));
  EXPECT_TRUE(says(to_string(scan.skipped[1]), {"rtss.dcm", "RTStructureSetStorage"}));
}

TEST(RealSeries, TiltedSeriesLeanAsTheirPositionsSayWhateverTheSignOfTheirTag) {
  TETWARP_REAL_DATA(philips, "tilt-uniform-philips");
  TETWARP_REAL_DATA(ge, "tilt-variable-spacing-ge");
  const DicomScan even = scan_dicom(philips), uneven = scan_dicom(ge);
  ASSERT_EQ(even.series.size(), 1u);
  ASSERT_EQ(uneven.series.size(), 1u);
  for (const DicomSeries& series : {even.series[0], uneven.series[0]}) {
    EXPECT_EQ(series.refusal, std::nullopt);
    expect_near(series.geometry.direction[2], {0, 0, 1});
    EXPECT_NEAR(series.geometry.direction[1].z, -0.3173047, 1e-7);
    ASSERT_EQ(series.warnings.size(), 1u);
    EXPECT_TRUE(says(series.warnings[0], {"gantry tilt", "18.5 degrees"}));
  }
  EXPECT_EQ(even.series[0].uneven, std::nullopt);
  EXPECT_NEAR(even.series[0].geometry.spacing.z, 2.5, 1e-9);
  const std::vector<double>& slices = uneven.series[0].geometry.slices;
  ASSERT_EQ(slices.size(), 28u);
  EXPECT_NEAR(slices[13], 13 * 4.22, 1e-6);
  EXPECT_NEAR(slices[14], 13 * 4.22 + 1.14, 1e-6);
  EXPECT_NEAR(slices[27], 13 * 4.22 + 1.14 + 13 * 7.38, 1e-6);
  EXPECT_TRUE(says(uneven.series[0].uneven.value_or(""), {"slice gap", "14 gaps of 27"}));
}

TEST(RealSeries, GapIsNamedAlthoughAcquisitionsWouldDivideIt) {
  TETWARP_REAL_DATA(folder, "slice-errors");
  const DicomScan gap = scan_dicom(folder / "gap");
  ASSERT_EQ(gap.series.size(), 1u);
  EXPECT_TRUE(says(gap.series[0].uneven.value_or(""), {"slice gap 10 mm", "IM-0001-0009-0001.dcm",
                                                       "IM-0001-0010-0001.dcm", "5 mm elsewhere", "1 slice missing"}));
}

TEST(RealSeries, FourAcquisitionsAtOnePositionAreFourImagesInTheirOrder) {
  TETWARP_REAL_DATA(folder, "slice-errors");
  const DicomScan scan = scan_dicom(folder / "same-position");
  ASSERT_EQ(scan.series.size(), 4u);
  const char* files[] = {"004.dcm", "003.dcm", "002.dcm", "001.dcm"};
  const std::int64_t sums[] = {-235153598, -235129399, -235151441, -235207036};
  for (int n = 0; n < 4; ++n) {
    const DicomSeries& series = scan.series[n];
    EXPECT_EQ(series.label, "acquisition " + std::to_string(12 + n));
    EXPECT_EQ(series.split_by, "Acquisition Number (0020,0012)");
    EXPECT_EQ(series.volumes, 4u);
    EXPECT_EQ(series.refusal, std::nullopt);
    ASSERT_EQ(series.slices.size(), 1u);
    EXPECT_EQ(series.slices[0].file.filename(), files[n]);
    EXPECT_EQ(sum_of(load_dicom(series)), sums[n]);
  }
}

#ifdef TETWARP_WITH_OPENJPEG
constexpr bool kReadsJpeg2000 = true;
#else
constexpr bool kReadsJpeg2000 = false;
#endif

TEST(RealSeries, Jpeg2000WithoutAnyUidReadsOrIsRefusedByNameWithItsGeometryKnown) {
  TETWARP_REAL_DATA(folder, "abdomen-j2k-20");
  const DicomScan scan = scan_dicom(folder);
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series[0].series_uid, "");
  EXPECT_EQ(scan.series[0].geometry.size, glm::i64vec3(512, 512, 20));
  if (!kReadsJpeg2000) {
    EXPECT_TRUE(is_refused(scan, {"JPEG 2000", "1.2.840.10008.1.2.4.90", "no OpenJPEG", "decompress"}));
    EXPECT_THROW(load_dicom(scan.series[0]), InputError);
    return;
  }
  expect_facts(scan.series[0], {{512, 512, 20},
                                {0.9765625, 0.9765625, 2},
                                {-249.51171875, -437.51171875, -804.5},
                                -1024,
                                1839,
                                2096491781,
                                -1024});
}

DicomVolume load_single(const fs::path& file) {
  const DicomScan scan = scan_dicom(file, true);
  if (scan.series.size() != 1) throw std::runtime_error("no series in " + file.string());
  return load_dicom(scan.series[0]);
}

TEST(RealSeries, SixteenTransferSyntaxesDecodeToTheSameSlice) {
  TETWARP_REAL_DATA(folder, "ct-transfer-syntaxes");
  const DicomVolume reference = load_single(folder / "CTImage.dcm");
  const auto worst_difference = [&](const DicomVolume& other) {
    int worst = 0;
    for (std::size_t i = 0; i < reference.volume.voxels.size(); ++i) {
      worst = std::max(worst, std::abs(reference.volume.voxels[i] - other.volume.voxels[i]));
    }
    return worst;
  };
  // HU. The last four were quantised to steps of 32 or 2 HU and then lost a little to JPEG: what they differ by is
  // known.
  const auto allowed = [](const std::string& name) {
    if (name.ends_with("4.81.dcm")) return 1;
    if (name.ends_with("4.91.dcm")) return 5;
    if (name.ends_with("4.50.dcm")) return 64;
    return name.ends_with("4.51.dcm") || name.ends_with("4.53.dcm") || name.ends_with("4.55.dcm") ? 36 : 0;
  };
  int decoded = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (!kReadsJpeg2000 && name.find("JPEG2000") != std::string::npos) {
      EXPECT_TRUE(is_refused(scan_dicom(entry.path(), true), {"JPEG 2000", "1.2.840.10008.1.2.4.9", name}));
      continue;
    }
    EXPECT_LE(worst_difference(load_single(entry.path())), allowed(name)) << name;
    ++decoded;
  }
  EXPECT_EQ(decoded, kReadsJpeg2000 ? 16 : 14);
}

TEST(RealSeries, LosslessEncodingsOfOneSliceAreOneImageAndLossyOnesAreOthers) {
  TETWARP_REAL_DATA(folder, "ct-transfer-syntaxes");
  const DicomScan scan = scan_dicom(folder);
  if (!kReadsJpeg2000) {
    EXPECT_TRUE(is_refused(scan, {"SOP Instance UID 1.2.840.113619.2.30.1.1762295590.1623.978668950.109",
                                  "cannot be compared", "JPEG2000LosslessOnly", "take away"}));
    return;
  }
  EXPECT_TRUE(is_refused(scan, {"7 slices at the same position", "CTImage.dcm, ", "JPEGLSLossy"}));
  EXPECT_TRUE(says(scan.series[0].warnings.at(0), {"9 identical copies of slices left out", "CTImage.dcm"}));
}

struct OddFile {
  std::string name;
  /// Words of the refusal, or of the reason for skipping; empty: the series can be read.
  std::vector<std::string> words;
};

const std::vector<OddFile> kOddFiles = {
    {"enhanced/eCT_Supplemental.dcm", {}},
    {"orientation/OrthogonalDirectionsTest.dcm", {}},
    {"orientation/DicomDirectionsTest_1020_0075.dcm", {"localizer"}},
    {"orientation/explicit_VR-UN.dcm",
     kReadsJpeg2000 ? std::vector<std::string>() : std::vector<std::string>{"JPEG 2000"}},
    {"headers/dicom-sc_cs-1.dcm", {}},
    {"headers/NoPreambleDicomTest.dcm", {"RTDoseStorage"}},
    {"headers/no_meta.dcm", {"not DICOM"}},
    {"headers/no_meta_group_length.dcm", {"RTImageStorage", "not an image"}},
    {"headers/meta_missing_tsyntax.dcm", {"without an image"}},
    {"headers/ExplVR_LitEndNoMeta.dcm", {"RTIonPlanStorage"}},
    {"headers/badVR.dcm", {"RTDoseStorage"}},
    {"headers/CT_small.dcm", {}},
    {"truncated/MR_truncated.dcm", {"MRImageStorage"}},
    {"truncated/rtplan_truncated.dcm", {"RTPlanStorage"}},
    {"truncated/MR_small_padded.dcm", {"MRImageStorage"}},
    {"bits/12bitUnsigned_0x0F0F.dcm", {"MRImageStorage"}},
    {"bits/12bitUnsigned.dcm", {"MRImageStorage"}},
    {"bits/itkGDCMImageIOTest3_mono1.dcm", {"ComputedRadiographyImageStorage"}},
    {"bits/slopeIntercept.dcm", {"MRImageStorage"}},
    {"compressed/2020-09-12-ELSCINT1-PMSCT_RLE1.dcm", {"PMSCT_RLE1", "(07A1,1011)"}},
    {"compressed/bad_sequence.dcm", {}},
    {"compressed/GH177_D_CLUNIE_CT1_IVRLE_BigEndian_ELE_undefinded_length.dcm", {}},
};

TEST(RealSeries, EveryOddFileReadsOrIsRefusedWithTheReason) {
  TETWARP_REAL_DATA(folder, "odd-files");
  for (const OddFile& file : kOddFiles) {
    const DicomScan scan = scan_dicom(folder / file.name, true);
    ASSERT_EQ(scan.series.size() + scan.skipped.size(), 1u) << file.name;
    if (!scan.skipped.empty()) {
      EXPECT_TRUE(says(to_string(scan.skipped[0]), file.words)) << file.name;
    } else if (file.words.empty()) {
      EXPECT_NO_THROW(load_dicom(scan.series[0])) << file.name;
    } else {
      EXPECT_TRUE(is_refused(scan, file.words)) << file.name;
    }
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "charset")) {
    EXPECT_TRUE(is_refused(scan_dicom(entry.path(), true), {"expected CT Image Storage"})) << entry.path();
  }
}

TEST(RealSeries, OddFilesReadWithTheirStatedGeometryAndValues) {
  TETWARP_REAL_DATA(folder, "odd-files");
  const DicomVolume rotated = load_single(folder / "orientation/OrthogonalDirectionsTest.dcm");
  EXPECT_NEAR(rotated.volume.geometry.direction[1].x, -std::sqrt(0.5), 1e-15);
  const DicomVolume bare = load_single(folder / "headers/dicom-sc_cs-1.dcm");
  expect_near(bare.volume.geometry.spacing, {0.484375, 0.484375, 3});
  expect_near(bare.volume.geometry.origin, {-122, -144, -836});
  const DicomVolume undefined_length = load_single(folder / kOddFiles.back().name);
  ASSERT_TRUE(undefined_length.padding);
  EXPECT_EQ(undefined_length.padding->low, -3024);
  // The sum of HU that pydicom and GDCM give.
  EXPECT_EQ(sum_of(rotated), -385703173);
  EXPECT_EQ(sum_of(bare), -197319300);
  EXPECT_EQ(sum_of(undefined_length), -228407043);
  EXPECT_EQ(sum_of(load_single(folder / "headers/CT_small.dcm")), -1950906);
  EXPECT_EQ(sum_of(load_single(folder / "compressed/bad_sequence.dcm")), -20086954);
  if (!kReadsJpeg2000) return;
  const DicomVolume flipped = load_single(folder / "orientation/explicit_VR-UN.dcm");
  EXPECT_EQ(sum_of(flipped), -175887460);
  EXPECT_EQ(flipped.volume.geometry.direction[1], glm::dvec3(0, -1, 0));
}

}  // namespace
}  // namespace tetwarp
