// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Enhanced multi-frame CT: the same volumes as of the classic slices that it was made of.
#include <gtest/gtest.h>

#include "io/dicom_series.h"
#include "tests/support/dicom/enhanced_maker.h"
#include "tests/support/dicom/only_series.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

void expect_same_volume(const fs::path& enhanced, const fs::path& classic) {
  const DicomSeries frames = only_series(enhanced), files = only_series(classic);
  EXPECT_EQ(frames.refusal, std::nullopt);
  EXPECT_EQ(frames.uneven.has_value(), files.uneven.has_value());
  const DicomVolume a = load_dicom(frames), b = load_dicom(files);
  EXPECT_EQ(a.volume.geometry, b.volume.geometry);
  EXPECT_EQ(a.volume.voxels, b.volume.voxels);
  EXPECT_EQ(a.rounded, b.rounded);
  EXPECT_EQ(a.padding.has_value(), b.padding.has_value());
}

/// The frames of a series that are slices, in the order of the slices.
std::vector<int> frames_of(const DicomSeries& series) {
  std::vector<int> frames;
  for (const DicomSlice& slice : series.slices) frames.push_back(slice.frame.value_or(-1));
  return frames;
}

std::vector<std::string> labels_of(const DicomScan& scan) {
  std::vector<std::string> labels;
  for (const DicomSeries& series : scan.series) labels.push_back(series.label);
  return labels;
}

class EnhancedCt : public testing::Test {
 protected:
  /// Both as files, and compares them.
  void expect_same(const ClassicSlices& slices, const MadeEnhanced& made = {}) {
    write_classic(folder_ / "classic", slices);
    made.write(folder_ / "enhanced" / "all.dcm", slices);
    expect_same_volume(folder_ / "enhanced", folder_ / "classic");
  }
  DicomScan scan(const ClassicSlices& slices, const MadeEnhanced& made) {
    made.write(folder_ / "enhanced" / "all.dcm", slices);
    return scan_dicom(folder_ / "enhanced");
  }

  const Scratch folder_;
};

TEST_F(EnhancedCt, FramesAreTheSlicesOfClassicFiles) {
  expect_same(classic_stack(5));
  const DicomScan found = scan_dicom(folder_ / "enhanced");
  EXPECT_EQ(found.files, 1u);
  EXPECT_EQ(frames_of(found.series.front()), (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(found.series.front().geometry.spacing, glm::dvec3(0.5, 0.75, 2.5));
}

TEST_F(EnhancedCt, SharedGroupsHoldForEveryFrame) { expect_same(classic_stack(5), {.all_shared = true}); }

TEST_F(EnhancedCt, GroupsOfAFrameComeBeforeSharedOnes) {
  expect_same(classic_stack(5),
              {.all_shared = true, .edit_groups = {}, .edit = [](DcmDataset& data) {
                 DcmItem* shared = nullptr;
                 data.findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, shared, 0);
                 macro_of(*shared, DCM_PixelValueTransformationSequence).putAndInsertString(DCM_RescaleSlope, "7");
                 macro_of(*shared, DCM_PlanePositionSequence).putAndInsertString(DCM_ImagePositionPatient, "1\\2\\3");
                 data.putAndInsertString(DCM_ImagePositionPatient, "4\\5\\6");
               }});
}

TEST_F(EnhancedCt, LegacyConvertedFilesAreRead) {
  expect_same(classic_stack(4), {.sop_class = UID_LegacyConvertedEnhancedCTImageStorage});
}

TEST_F(EnhancedCt, FramesAreSortedAlongTheNormal) {
  expect_same(classic_stack(
      6, [](int k, MadeSlice& slice) { slice.position = position_text(-10, -20, 30 + 2.5 * (k * 5 % 6)); }));
  EXPECT_EQ(frames_of(only_series(folder_ / "enhanced")), (std::vector<int>{0, 5, 4, 3, 2, 1}));
}

TEST_F(EnhancedCt, ObliqueTiltedAndUnevenStacksAreThoseOfClassicFiles) {
  expect_same(classic_stack(5, [](int k, MadeSlice& slice) {
    slice.orientation = "0.8\\0.6\\0\\0\\0\\-1";
    slice.position = position_text(3 - 0.6 * 2.5 * k, 0.8 * 2.5 * k, 7);
  }));
  expect_same(classic_stack(5, [](int, MadeSlice& slice) { slice.orientation = "1\\0\\0\\0\\0.9483237\\-0.3173047"; }));
  EXPECT_TRUE(says(only_series(folder_ / "enhanced").warnings.front(), {"gantry tilt", "18.5 degrees"}));
  expect_same(classic_stack(
      5, [](int k, MadeSlice& slice) { slice.position = position_text(-10, -20, k < 3 ? 2.5 * k : 4.0 * k); }));
  EXPECT_TRUE(says(*only_series(folder_ / "enhanced").uneven, {"all.dcm, frame 3 and ", "all.dcm, frame 4"}));
}

TEST_F(EnhancedCt, SlopeAndInterceptAreEachFramesOwn) {
  expect_same(classic_stack(4, [](int k, MadeSlice& slice) {
    slice.slope = k % 2 == 0 ? "1" : "1.25";
    slice.intercept = std::to_string(-1000 + k);
  }));
  EXPECT_GT(load_dicom(only_series(folder_ / "enhanced")).rounded, 0u);
}

TEST_F(EnhancedCt, PaddingOfTheFileIsThatOfEveryFrame) {
  MadeEnhanced made;
  made.edit = [](DcmDataset& data) { data.putAndInsertUint16(DCM_PixelPaddingValue, 3); };
  const DicomScan found = scan(classic_stack(3), made);
  const auto padding = load_dicom(found.series.front()).padding;
  ASSERT_TRUE(padding.has_value());
  EXPECT_EQ(padding->low, 3 - 1024);
}

TEST_F(EnhancedCt, TemporalPositionsAreVolumesOfTheirOwn) {
  const ClassicSlices slices =
      classic_stack(12, [](int k, MadeSlice& slice) { slice.position = position_text(-10, -20, 30 + 2.5 * (k % 4)); });
  MadeEnhanced made;
  made.edit_groups = [](int k, DcmItem& groups) {
    macro_of(groups, DCM_FrameContentSequence).putAndInsertUint32(DCM_TemporalPositionIndex, 3 - k / 4);
  };
  const DicomScan found = scan(slices, made);
  EXPECT_EQ(labels_of(found), (std::vector<std::string>{"time point 1", "time point 2", "time point 3"}));
  EXPECT_EQ(found.series.front().split_by, "Temporal Position Index (0020,9128)");
  EXPECT_EQ(frames_of(found.series.front()), (std::vector<int>{8, 9, 10, 11}));
  const DicomVolume first = load_dicom(found.series.front());
  EXPECT_EQ(first.volume.voxels[0], 800 - 1024);
  EXPECT_EQ(first.headers != nullptr, true);
}

TEST_F(EnhancedCt, PhasesKernelsAndAcquisitionsOfFramesTellVolumesApart) {
  struct Way {
    DcmTagKey sequence, tag;
    std::string first, second, label;
  };
  const ClassicSlices slices =
      classic_stack(8, [](int k, MadeSlice& slice) { slice.position = position_text(-10, -20, 30 + 2.5 * (k % 4)); });
  for (const Way& way : std::initializer_list<Way>{
           {DCM_CardiacSynchronizationSequence, DCM_NominalPercentageOfCardiacPhase, "40", "75", "heart phase 75 %"},
           {DCM_RespiratorySynchronizationSequence, DCM_NominalPercentageOfRespiratoryPhase, "0", "50",
            "breathing phase 50 %"},
           {DCM_CTReconstructionSequence, DCM_ConvolutionKernel, "B30f", "B70f", "kernel B70f"},
           {DCM_CTXRayDetailsSequence, DCM_KVP, "80", "140", "140 kV"},
           {DCM_PixelMeasuresSequence, DCM_SliceThickness, "1", "5", "slices 5 mm thick"},
           {DCM_FrameContentSequence, DCM_FrameComments, "phase 20%", "phase 70%", "phase 70 %"},
           {DCM_FrameContentSequence, DCM_FrameAcquisitionDateTime, "20200104101112", "20200104101512",
            "acquired 2020-01-04 10:15:12"},
           {DCM_IrradiationEventIdentificationSequence, DCM_IrradiationEventUID, "1.2.1", "1.2.2",
            "irradiation event 1.2.2"}}) {
    MadeEnhanced made;
    made.edit_groups = [&](int k, DcmItem& groups) {
      macro_of(groups, way.sequence).putAndInsertString(way.tag, (k < 4 ? way.first : way.second).c_str());
    };
    const DicomScan found = scan(slices, made);
    ASSERT_EQ(found.series.size(), 2u) << way.label << ": " << found.series.front().refusal.value_or("");
    EXPECT_EQ(found.series[1].label, way.label);
    EXPECT_EQ(frames_of(found.series[1]), (std::vector<int>{4, 5, 6, 7}));
  }
}

TEST_F(EnhancedCt, ContrastAgentOfAFrameIsTheOneThatHadBeenGiven) {
  const ClassicSlices slices =
      classic_stack(8, [](int k, MadeSlice& slice) { slice.position = position_text(-10, -20, 30 + 2.5 * (k % 4)); });
  MadeEnhanced made;
  made.edit_groups = [&](int k, DcmItem& groups) {
    DcmItem& usage = macro_of(groups, DCM_ContrastBolusUsageSequence);
    usage.putAndInsertUint16(DCM_ContrastBolusAgentNumber, 1);
    usage.putAndInsertString(DCM_ContrastBolusAgentAdministered, k < 4 ? "NO" : "YES");
  };
  made.edit = [](DcmDataset& data) {
    DcmItem* agent = nullptr;
    data.findOrCreateSequenceItem(DCM_ContrastBolusAgentSequence, agent, 0);
    agent->putAndInsertUint16(DCM_ContrastBolusAgentNumber, 1);
    agent->putAndInsertString(DCM_CodeMeaning, "Iopamidol");
  };
  EXPECT_EQ(labels_of(scan(slices, made)),
            (std::vector<std::string>{"no Contrast/Bolus Agent", "contrast agent Iopamidol"}));
}

TEST_F(EnhancedCt, DimensionsThatAreNoPlaceTellVolumesApart) {
  const ClassicSlices slices =
      classic_stack(8, [](int k, MadeSlice& slice) { slice.position = position_text(-10, -20, 30 + 2.5 * (k % 4)); });
  MadeEnhanced made;
  made.edit_groups = [](int k, DcmItem& groups) {
    const Uint32 indices[] = {static_cast<Uint32>(k % 4 + 1), static_cast<Uint32>(k / 4 + 1)};
    macro_of(groups, DCM_FrameContentSequence).putAndInsertUint32Array(DCM_DimensionIndexValues, indices, 2);
  };
  made.edit = [](DcmDataset& data) {
    for (const DcmTagKey& pointer : {DCM_InStackPositionNumber, DcmTagKey(0x0018, 0x9333)}) {
      DcmItem* dimension = nullptr;
      data.findOrCreateSequenceItem(DCM_DimensionIndexSequence, dimension, -2);
      auto element = std::make_unique<DcmAttributeTag>(DcmTag(DCM_DimensionIndexPointer));
      element->putTagVal(pointer);
      dimension->insert(element.release());
    }
  };
  EXPECT_EQ(labels_of(scan(slices, made)), (std::vector<std::string>{"dimension index 1", "dimension index 2"}));
}

TEST_F(EnhancedCt, StacksAreVolumesOfTheirOwnWhereverTheyLie) {
  const ClassicSlices slices = classic_stack(
      9, [](int k, MadeSlice& slice) { slice.position = position_text(-10, -20, k < 4 ? 2.5 * k : 100 + 2.5 * k); });
  MadeEnhanced made;
  made.edit_groups = [](int k, DcmItem& groups) {
    macro_of(groups, DCM_FrameContentSequence).putAndInsertString(DCM_StackID, k < 4 ? "HEAD" : "NECK");
  };
  const DicomScan found = scan(slices, made);
  EXPECT_EQ(labels_of(found), (std::vector<std::string>{"stack HEAD", "stack NECK"}));
  EXPECT_EQ(found.series[1].geometry.size.z, 5);
  EXPECT_EQ(found.series[1].uneven, std::nullopt);
}

TEST_F(EnhancedCt, LocalizerFramesAreSetAsideByTheirNumber) {
  const ClassicSlices slices = classic_stack(5);
  MadeEnhanced made;
  made.edit_groups = [](int k, DcmItem& groups) {
    if (k == 2)
      macro_of(groups, DCM_CTImageFrameTypeSequence)
          .putAndInsertString(DCM_FrameType, "ORIGINAL\\PRIMARY\\LOCALIZER\\NONE");
  };
  const DicomScan found = scan(slices, made);
  ASSERT_EQ(found.series.front().set_aside.size(), 1u);
  EXPECT_TRUE(says(to_string(found.series.front().set_aside.front()), {"all.dcm, frame 3: a localizer"}));
  EXPECT_EQ(frames_of(found.series.front()), (std::vector<int>{0, 1, 3, 4}));
}

/// Slices [begin, end) as an instance of a concatenation (PS3.3 C.7.6.16.2.2.4).
void write_part(const fs::path& path, const ClassicSlices& all, int number, std::size_t begin, std::size_t end) {
  ClassicSlices part;
  for (std::size_t k = begin; k < end; ++k) part.push_back(std::make_unique<DcmDataset>(*all[k]));
  MadeEnhanced made;
  made.sop_instance = "1.2.3.90" + std::to_string(number);
  made.edit = [&](DcmDataset& data) {
    data.putAndInsertString(DCM_ConcatenationUID, "1.2.3.77");
    data.putAndInsertUint16(DCM_InConcatenationNumber, static_cast<Uint16>(number));
    data.putAndInsertUint32(DCM_ConcatenationFrameOffsetNumber, static_cast<Uint32>(begin));
  };
  made.write(path, part);
}

TEST_F(EnhancedCt, InstancesOfAConcatenationAreOneVolume) {
  const ClassicSlices slices = classic_stack(7);
  write_classic(folder_ / "classic", slices);
  write_part(folder_ / "enhanced" / "a.dcm", slices, 2, 3, 7);
  write_part(folder_ / "enhanced" / "b.dcm", slices, 1, 0, 3);
  expect_same_volume(folder_ / "enhanced", folder_ / "classic");
  const DicomSeries series = only_series(folder_ / "enhanced");
  EXPECT_EQ(frames_of(series), (std::vector<int>{0, 1, 2, 0, 1, 2, 3}));
  for (int k = 0; k < 7; ++k) EXPECT_EQ(series.slices[k].instance_number, k + 1);
  EXPECT_EQ(scan_dicom(folder_ / "enhanced").files, 2u);
}

TEST_F(EnhancedCt, FramesAndClassicFilesMakeOneVolume) {
  const ClassicSlices slices = classic_stack(7);
  write_classic(folder_ / "classic", slices);
  write_part(folder_ / "mixed" / "part.dcm", slices, 1, 0, 4);
  for (const char* name : {"s004.dcm", "s005.dcm", "s006.dcm"})
    fs::copy_file(folder_ / "classic" / name, folder_ / "mixed" / name);
  expect_same_volume(folder_ / "mixed", folder_ / "classic");
}

TEST_F(EnhancedCt, CopyOfAFileCountsOnceAndAnotherFileOfItsUidIsRefused) {
  const ClassicSlices slices = classic_stack(5);
  expect_same(slices);
  fs::copy_file(folder_ / "enhanced" / "all.dcm", folder_ / "enhanced" / "copy.dcm");
  const DicomSeries twice = only_series(folder_ / "enhanced");
  EXPECT_EQ(twice.refusal, std::nullopt);
  EXPECT_EQ(twice.slices.size(), 5u);
  EXPECT_TRUE(says(twice.warnings.front(), {"1 identical copy", "copy.dcm of ", "all.dcm"}));
  MadeEnhanced other;
  other.edit = [](DcmDataset& data) { data.putAndInsertString(DCM_ContentTime, "222222"); };
  other.write(folder_ / "enhanced" / "copy.dcm", slices);
  EXPECT_TRUE(says(only_series(folder_ / "enhanced").refusal.value_or(""),
                   {"1.2.3.900", "several frames", "not the same byte for byte"}));
}

TEST_F(EnhancedCt, CopyOfAFileWithoutUidCountsOnce) {
  MadeEnhanced made;
  made.sop_instance = "";
  made.write(folder_ / "enhanced" / "all.dcm", classic_stack(5));
  fs::copy_file(folder_ / "enhanced" / "all.dcm", folder_ / "enhanced" / "copy.dcm");
  const DicomSeries twice = only_series(folder_ / "enhanced");
  EXPECT_EQ(twice.refusal, std::nullopt);
  EXPECT_EQ(twice.slices.size(), 5u);
}

TEST_F(EnhancedCt, OneFileStandsForItsFrames) {
  expect_same(classic_stack(5));
  const fs::path file = folder_ / "enhanced" / "all.dcm";
  EXPECT_EQ(scan_dicom(file, true).series.front().slices.size(), 5u);
  EXPECT_EQ(scan_dicom(file).series.front().slices.size(), 5u);
}

TEST_F(EnhancedCt, DigestIsThatOfTheFileWhateverTheThreads) {
  expect_same(classic_stack(5));
  const DicomSeries series = only_series(folder_ / "enhanced");
  const DicomVolume one = load_dicom(series, 1), all = load_dicom(series);
  EXPECT_EQ(one.sha256, all.sha256);
  EXPECT_EQ(one.volume.voxels, all.volume.voxels);
  MadeEnhanced other;
  other.edit = [](DcmDataset& data) { data.putAndInsertString(DCM_ContentTime, "222222"); };
  other.write(folder_ / "enhanced" / "all.dcm", classic_stack(5));
  EXPECT_NE(load_dicom(only_series(folder_ / "enhanced")).sha256, one.sha256);
}

TEST_F(EnhancedCt, OtherMultiFrameKindsAreSetAsideByName) {
  for (const auto& [kind, name] : {std::pair{UID_EnhancedMRImageStorage, "MR images"},
                                   {UID_EnhancedPETImageStorage, "PET images"},
                                   {UID_MultiframeGrayscaleWordSecondaryCaptureImageStorage, "pictures"}}) {
    const DicomSeries series = scan(classic_stack(3), {.sop_class = kind}).series.front();
    EXPECT_TRUE(says(series.refusal.value_or(""), {name, "expected CT Image Storage"}));
    EXPECT_EQ(series.slices.size(), 0u);
  }
}

TEST_F(EnhancedCt, ClassicCtOfSeveralFramesIsRefused) {
  const DicomSeries series = scan(classic_stack(3), {.sop_class = UID_CTImageStorage}).series.front();
  EXPECT_TRUE(series.refusal.has_value());
}

}  // namespace
}  // namespace tetwarp
