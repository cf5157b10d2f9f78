// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Enhanced CT made of a real series, as other programs see it; and the derived series of both.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <set>
#include <sstream>

#include "tests/io/dicom/derive/derived_source.h"
#include "tests/support/dicom/enhanced_maker.h"
#include "tests/support/dicom/only_series.h"
#include "tests/support/other_readers.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"

namespace fs = std::filesystem;

namespace tetwarp::test {
namespace {

DicomDerivation derivation() {
  return {.field_sha256 = std::string(64, 'a'),
          .parameters = "interpolation=linear outside=refuse",
          .description = "Deformed by a vertex field"};
}

/// A derived series with the voxels of its source, each slice interpolated from itself and the next one.
void write_derived(const fs::path& folder, const DicomVolume& source) {
  std::vector<SliceRange> sampled;
  const std::int64_t slices = source.volume.geometry.size.z;
  for (std::int64_t k = 0; k < slices; ++k) sampled.push_back({k, std::min(k + 1, slices - 1)});
  fs::create_directories(folder);
  write_derived_series(folder, view(source.volume), *source.headers, derivation(), sampled);
}

/// The different lines of dciodvfy over all files.
std::set<std::string> dciodvfy_lines(const fs::path& folder) {
  std::set<std::string> lines;
  for (const auto& file : fs::directory_iterator(folder)) {
    std::istringstream output(run_command("dciodvfy " + quoted(file.path())).output);
    for (std::string line; std::getline(output, line);) {
      if (line.starts_with("Error") || line.starts_with("Warning")) lines.insert(line);
    }
  }
  return lines;
}

/// The attributes of a classic CT file and those of functional groups, in all of their kinds.
void put_more_groups(int k, DcmItem& groups) {
  const auto put = [&](const DcmTagKey& sequence, const DcmTagKey& tag, const std::string& value) {
    macro_of(groups, sequence).putAndInsertString(tag, value.c_str());
  };
  put(DCM_FrameContentSequence, DCM_TemporalPositionIndex, "1");
  put(DCM_FrameContentSequence, DCM_DimensionIndexValues, "1\\2\\3");
  put(DCM_FrameContentSequence, DCM_FrameAcquisitionDateTime, "20200105111213.5");
  put(DCM_FrameContentSequence, DCM_FrameAcquisitionNumber, "7");
  put(DCM_FrameContentSequence, DCM_FrameComments, "with care");
  put(DCM_FrameVOILUTSequence, DCM_WindowCenter, "40");
  put(DCM_FrameVOILUTSequence, DCM_WindowWidth, "400");
  put(DCM_FrameAnatomySequence, DCM_FrameLaterality, "R");
  put(DCM_CTAcquisitionDetailsSequence, DCM_RotationDirection, "CW");
  put(DCM_CTAcquisitionDetailsSequence, DCM_GantryDetectorTilt, "0");
  put(DCM_CTTableDynamicsSequence, DCM_SpiralPitchFactor, "1.5");
  put(DCM_CTPositionSequence, DCM_TablePosition, std::to_string(k));
  put(DCM_CTGeometrySequence, DCM_DistanceSourceToDetector, "1000");
  put(DCM_CTReconstructionSequence, DCM_ConvolutionKernel, "B30f");
  put(DCM_CTReconstructionSequence, DCM_ReconstructionAlgorithm, "FILTER_BACK_PROJ");
  put(DCM_CTExposureSequence, DCM_ExposureTimeInms, "499.6");
  put(DCM_CTExposureSequence, DCM_XRayTubeCurrentInmA, std::to_string(200 + k));
  put(DCM_CTXRayDetailsSequence, DCM_KVP, "120");
  put(DCM_IrradiationEventIdentificationSequence, DCM_IrradiationEventUID, "1.2.3.55");
  groups.putAndInsertString(DcmTag(0x0021, 0x0010, EVR_LO), "VENDOR");
  groups.insert(new DcmSequenceOfItems(DcmTag(0x0021, 0x1001, EVR_SQ)));
  DcmItem& unassigned = macro_of(groups, DCM_UnassignedPerFrameConvertedAttributesSequence);
  for (const auto& [tag, value] : std::initializer_list<std::pair<DcmTagKey, const char*>>{
           {DCM_ProtocolName, "Thorax"}, {DCM_PatientName, "SOMEBODY^ELSE"}, {DCM_Rows, "9"}})
    unassigned.putAndInsertString(tag, value);
}

TEST(DerivedOfEnhancedCt, HasTheAttributesOfTheGroupsAndNothingOfTheFrames) {
  const Scratch scratch;
  MadeEnhanced made;
  made.edit_groups = put_more_groups;
  made.edit = [](DcmDataset& data) {
    data.putAndInsertString(DCM_ConcatenationUID, "1.2.3.77");
    data.putAndInsertString(DCM_DimensionOrganizationType, "3D");
    data.putAndInsertString(DCM_VolumetricProperties, "VOLUME");
    DcmItem* item = nullptr;
    data.findOrCreateSequenceItem(DCM_DimensionIndexSequence, item, 0);
    data.findOrCreateSequenceItem(DCM_AcquisitionContextSequence, item, 0);
  };
  made.write(scratch / "in.dcm", classic_stack(4));
  write_derived(scratch / "out", load_dicom(only_series(scratch / "in.dcm")));
  Written slice(scratch / "out" / "IM00002.dcm");
  for (const auto& [tag, value] : std::initializer_list<std::pair<DcmTagKey, const char*>>{
           {DCM_SOPClassUID, UID_CTImageStorage},
           {DCM_ImageType, "DERIVED\\SECONDARY\\AXIAL"},
           {DCM_PatientName, "SECRET^NAME"},
           {DCM_InstanceNumber, "2"},
           {DCM_ImagePositionPatient, "-10\\-20\\32.500000"},
           {DCM_ImageOrientationPatient, "1\\0\\0\\0\\1\\0"},
           {DCM_PixelSpacing, "0.75\\0.5"},
           {DCM_AcquisitionNumber, "7"},
           {DCM_AcquisitionDateTime, "20200105111213.5"},
           {DCM_ImageComments, "with care"},
           {DCM_WindowCenter, "40"},
           {DCM_WindowWidth, "400"},
           {DCM_ImageLaterality, "R"},
           {DCM_RotationDirection, "CW"},
           {DCM_SpiralPitchFactor, "1.5"},
           {DCM_DistanceSourceToDetector, "1000"},
           {DCM_ConvolutionKernel, "B30f"},
           {DCM_ExposureTime, "500"},
           {DCM_XRayTubeCurrent, "<missing>"},  // differs from slice to slice
           {DCM_KVP, "120"},
           {DCM_IrradiationEventUID, "1.2.3.55"},
           {DCM_ProtocolName, "Thorax"}})
    EXPECT_EQ(slice[tag], value) << tag.toString();
  for (const DcmTagKey& tag :
       {DCM_NumberOfFrames, DCM_SharedFunctionalGroupsSequence, DCM_PerFrameFunctionalGroupsSequence,
        DCM_DimensionIndexSequence, DCM_DimensionOrganizationType, DCM_ConcatenationUID, DCM_VolumetricProperties,
        DCM_AcquisitionContextSequence, DCM_StackID, DCM_TemporalPositionIndex, DCM_DimensionIndexValues,
        DCM_InStackPositionNumber, DCM_ReconstructionAlgorithm, DCM_TablePosition, DcmTagKey(0x0021, 0x1001)})
    EXPECT_FALSE(slice.data().tagExists(tag)) << tag.toString();
  ASSERT_EQ(items_of(slice.data(), DCM_SourceImageSequence), 1u) << "one file, of which two frames";
  DcmItem& image = item_of(slice.data(), DCM_SourceImageSequence);
  EXPECT_EQ(get(image, DCM_ReferencedSOPClassUID), UID_EnhancedCTImageStorage);
  EXPECT_EQ(get(image, DCM_ReferencedSOPInstanceUID), "1.2.3.900");
  EXPECT_EQ(get(image, DCM_ReferencedFrameNumber), "2\\3");
  EXPECT_EQ(
      get(item_of(Written(scratch / "out" / "IM00004.dcm").data(), DCM_SourceImageSequence), DCM_ReferencedFrameNumber),
      "4");
}

/// A series, as it is and with all its slices in one Enhanced file.
class RealEnhancedCt : public testing::Test {
 protected:
  void SetUp() override {
    TETWARP_REAL_DATA(folder, "chest-cmb-crc");
    const DicomSeries series = only_series(folder);
    for (const DicomSlice& slice : series.slices) files_.push_back(slice.file);
    classic_ = load_dicom(series);
    MadeEnhanced().write(file_, classic_files(files_));
    enhanced_ = load_dicom(only_series(file_));
  }

  const Scratch scratch_;
  const fs::path file_ = scratch_ / "enhanced" / "all.dcm";
  std::vector<fs::path> files_;
  DicomVolume classic_, enhanced_;
};

TEST_F(RealEnhancedCt, VoxelsAndGeometryAreThoseOfTheClassicSeries) {
  EXPECT_EQ(enhanced_.volume.geometry, classic_.volume.geometry);
  EXPECT_TRUE(enhanced_.volume.voxels == classic_.volume.voxels);
  ASSERT_EQ(enhanced_.padding.has_value(), classic_.padding.has_value());
  if (classic_.padding) {
    EXPECT_EQ(enhanced_.padding->low, classic_.padding->low);
  }
}

/// Expects that pydicom reads the same voxels in the same places of a multi-frame file; the test is skipped where
/// pydicom is missing.
void check_with_pydicom(const fs::path& file, const Volume<std::int16_t>& volume, const fs::path& hu) {
  const Run run = run_command(TETWARP_PYTHON " " TETWARP_READ_ENHANCED " " + quoted(file) + " " + quoted(hu));
  if (run.status == 77 || run.status == 127) GTEST_SKIP() << run.output;
  ASSERT_EQ(run.status, 0) << run.output;
  const std::string bytes = file_bytes(hu);
  ASSERT_EQ(bytes.size(), 2 * volume.voxels.size());
  EXPECT_EQ(std::memcmp(bytes.data(), volume.voxels.data(), bytes.size()), 0);
  std::istringstream affine(run.output);
  const AffineMap ours = point_from_index(volume.geometry);
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) {
      double theirs = NAN;
      affine >> theirs;
      const glm::dvec3 axis(c == 0, c == 1, c == 2);
      EXPECT_NEAR(c < 3 ? (ours(axis) - ours(glm::dvec3(0)))[r] : ours(axis)[r], theirs, 1e-6) << r << ", " << c;
    }
  }
}

TEST_F(RealEnhancedCt, PydicomReadsTheSameVoxelsInTheSamePlaces) {
  check_with_pydicom(file_, enhanced_.volume, scratch_ / "hu");
}

TEST(SupplementOfTheStandard, IsReadAsPydicomReadsItAndItsDerivedSeriesIsClassicCt) {
  TETWARP_REAL_DATA(folder, "odd-files");
  const Scratch scratch;
  const fs::path file = folder / "enhanced" / "eCT_Supplemental.dcm";
  const DicomVolume volume = load_dicom(only_series(file));
  EXPECT_EQ(volume.volume.geometry.size, glm::i64vec3(512, 512, 2));
  write_derived(scratch / "out", volume);
  Written slice(scratch / "out" / "IM00001.dcm");
  EXPECT_EQ(slice[DCM_ContrastBolusAgent], "Iohexol");
  if (run_command("command -v dciodvfy").status == 0) {
    for (const std::string& line : dciodvfy_lines(scratch / "out"))
      EXPECT_TRUE(line.find("deprecated") != std::string::npos || line.find("<RCBF>") != std::string::npos) << line;
  }
  check_with_pydicom(file, volume.volume, scratch / "hu");
}

TEST_F(RealEnhancedCt, Dcm2niixReadsTheSameVoxelsInTheSamePlaces) {
  check_with("dcm2niix", scratch_ / "enhanced", enhanced_.volume, scratch_ / "expected.json");
}

TEST_F(RealEnhancedCt, DerivedSeriesHasThePixelsAndThePlacesOfTheClassicOne) {
  write_derived(scratch_ / "of-classic", classic_);
  write_derived(scratch_ / "of-enhanced", enhanced_);
  const DicomVolume a = load_dicom(only_series(scratch_ / "of-classic")),
                    b = load_dicom(only_series(scratch_ / "of-enhanced"));
  EXPECT_EQ(a.volume.geometry, b.volume.geometry);
  EXPECT_TRUE(a.volume.voxels == b.volume.voxels);
}

TEST_F(RealEnhancedCt, DciodvfyIsAsContentWithTheDerivedSeriesAsWithThatOfTheClassicSource) {
  if (run_command("command -v dciodvfy").status != 0) GTEST_SKIP() << "dciodvfy (dicom3tools) is not installed";
  write_derived(scratch_ / "of-classic", classic_);
  write_derived(scratch_ / "of-enhanced", enhanced_);
  const std::set<std::string> before = dciodvfy_lines(scratch_ / "of-classic"),
                              after = dciodvfy_lines(scratch_ / "of-enhanced");
  for (const std::string& line : after) EXPECT_TRUE(before.contains(line)) << line;
}

TEST(DerivedOfEnhancedCt, HasOnlyTheErrorsThatNobodyCanMend) {
  if (run_command("command -v dciodvfy").status != 0) GTEST_SKIP() << "dciodvfy (dicom3tools) is not installed";
  const Scratch scratch;
  const ClassicSlices slices = classic_stack(3);
  write_classic(scratch / "classic", slices);
  MadeEnhanced made;
  made.edit_groups = put_more_groups;
  made.write(scratch / "enhanced" / "all.dcm", slices);
  write_derived(scratch / "of-classic", load_dicom(only_series(scratch / "classic")));
  write_derived(scratch / "of-enhanced", load_dicom(only_series(scratch / "enhanced")));
  const std::set<std::string> before = dciodvfy_lines(scratch / "of-classic"),
                              after = dciodvfy_lines(scratch / "of-enhanced");
  for (const std::string& line : after) EXPECT_TRUE(before.contains(line) || line.starts_with("Warning")) << line;
}

}  // namespace
}  // namespace tetwarp::test
