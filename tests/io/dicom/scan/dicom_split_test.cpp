// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Series that hold several volumes, made up: which attribute tells them apart, and when none may.
#include <gtest/gtest.h>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

using Edit = std::function<void(DcmDataset&)>;

Edit put(const DcmTagKey& tag, const std::string& value) {
  return [tag, value](DcmDataset& data) { data.putAndInsertString(tag, value.c_str()); };
}

Edit put_float(const DcmTagKey& tag, float value) {
  return [tag, value](DcmDataset& data) { data.putAndInsertFloat32(tag, value); };
}

/// Writes slices into one series, each with an Instance Number and a UID that no other has.
class Folder {
 public:
  /// Slices first to last, 2.5 mm apart, each changed by all of the edits.
  void write(int first, int last, const std::vector<Edit>& edits, double shift = 0,
             const std::string& sub_folder = {}) {
    fs::create_directories(scratch_ / sub_folder);
    for (int k = first; k <= last; ++k) {
      MadeSlice slice;
      slice.position = position_text(-10, -20, 30 + 2.5 * k + shift);
      slice.instance_number = numbered ? ++count_ : 0;
      if (!numbered) ++count_;
      slice.sop_instance = std::string("1.2.3.").append(std::to_string(count_));
      slice.words = {static_cast<std::uint16_t>(count_)};
      slice.edit = [&](DcmDataset& data) {
        for (const Edit& edit : edits) edit(data);
      };
      write_slice(scratch_ / sub_folder / ("s" + std::to_string(1000 + count_) + ".dcm"), slice);
    }
  }
  std::vector<DicomSeries> series() const { return scan_dicom(scratch_.path()).series; }
  std::vector<std::string> labels() const {
    std::vector<std::string> labels;
    for (const DicomSeries& one : series()) labels.push_back(one.label);
    return labels;
  }

  bool numbered = true;  ///< false: no Instance Number tells anything
 private:
  const Scratch scratch_;
  int count_ = 0;
};

using Labels = std::vector<std::string>;

testing::AssertionResult is_one_refused_volume(const Folder& folder, const std::vector<std::string>& words) {
  const std::vector<DicomSeries> series = folder.series();
  if (series.size() != 1) return testing::AssertionFailure() << series.size() << " volumes";
  if (!series[0].label.empty()) return testing::AssertionFailure() << "labelled " << series[0].label;
  return says(series[0].refusal.value_or("accepted"), words);
}

struct Attribute {
  const char* name;
  std::function<Edit(int)> edit;  ///< changes of phase 0, 1, 2; phases are written in another order
  std::vector<std::string> labels;
  const char* split_by;
};

void PrintTo(const Attribute& attribute, std::ostream* out) { *out << attribute.name; }

class SplitBy : public testing::TestWithParam<Attribute> {};

TEST_P(SplitBy, TellsThreePhasesApartInTheirNaturalOrder) {
  const Attribute& attribute = GetParam();
  Folder folder;
  folder.numbered = false;
  for (const int phase : {1, 2, 0}) folder.write(0, 4, {attribute.edit(phase)});
  const std::vector<DicomSeries> series = folder.series();
  EXPECT_EQ(folder.labels(), attribute.labels);
  ASSERT_EQ(series.size(), 3u);
  for (std::size_t phase = 0; phase < 3; ++phase) {
    EXPECT_EQ(series[phase].refusal, std::nullopt);
    EXPECT_EQ(series[phase].split_by, attribute.split_by);
    EXPECT_EQ(series[phase].volumes, 3u);
    EXPECT_EQ(series[phase].geometry.size, glm::i64vec3(6, 4, 5));
    EXPECT_EQ(series[phase].slices[0].sop_instance_uid, phase == 0 ? "1.2.3.11" : phase == 1 ? "1.2.3.1" : "1.2.3.6");
  }
}

INSTANTIATE_TEST_SUITE_P(
    Attributes, SplitBy,
    testing::Values(
        Attribute{"TemporalPosition",
                  [](int n) { return put(DCM_TemporalPositionIdentifier, std::to_string(2 + 4 * n)); },
                  {"time point 2", "time point 6", "time point 10"},
                  "Temporal Position Identifier (0020,0100)"},
        Attribute{"CardiacPhase",
                  [](int n) { return put_float(DCM_NominalPercentageOfCardiacPhase, 5.0F + 45.0F * float(n)); },
                  {"heart phase 5 %", "heart phase 50 %", "heart phase 95 %"},
                  "Nominal Percentage of Cardiac Phase (0020,9241)"},
        Attribute{"BreathingPhase",
                  [](int n) { return put_float(DCM_NominalPercentageOfRespiratoryPhase, 50.0F * float(n)); },
                  {"breathing phase 0 %", "breathing phase 50 %", "breathing phase 100 %"},
                  "Nominal Percentage of Respiratory Phase (0020,9245)"},
        Attribute{"TriggerTime",
                  [](int n) { return put(DCM_TriggerTime, n == 0   ? "80.50"
                                                          : n == 1 ? "350"
                                                                   : "1.2E3"); },
                  {"trigger time 80.5 ms", "trigger time 350 ms", "trigger time 1200 ms"},
                  "Trigger Time (0018,1060)"},
        Attribute{"Description",
                  [](int n) { return put(DCM_SeriesDescription, "P4 Gated, " + std::to_string(50 * n) + ".0%"); },
                  {"phase 0 %", "phase 50 %", "phase 100 %"},
                  "Series Description (0008,103E)"},
        Attribute{"DescriptionInWords",
                  [](int n) { return put(DCM_SeriesDescription, n == 0   ? "T9"
                                                                : n == 1 ? "T10"
                                                                         : "T10 b"); },
                  {"\"T9\"", "\"T10\"", "\"T10 b\""},
                  "Series Description (0008,103E)"},
        Attribute{"Comments",
                  [](int n) { return put(DCM_ImageComments, "no names " + std::to_string(30 * n) + " %"); },
                  {"phase 0 %", "phase 30 %", "phase 60 %"},
                  "Image Comments (0020,4000)"},
        Attribute{"Acquisition",
                  [](int n) { return put(DCM_AcquisitionNumber, std::to_string(8 + n)); },
                  {"acquisition 8", "acquisition 9", "acquisition 10"},
                  "Acquisition Number (0020,0012)"},
        Attribute{"Kvp",
                  [](int n) { return put(DCM_KVP, n == 0   ? "80"
                                                  : n == 1 ? "100.0"
                                                           : "140"); },
                  {"80 kV", "100 kV", "140 kV"},
                  "KVP (0018,0060)"},
        Attribute{"Kernel",
                  [](int n) { return put(DCM_ConvolutionKernel, n == 0   ? "B8f"
                                                                : n == 1 ? "B30f"
                                                                         : "B70f"); },
                  {"kernel B8f", "kernel B30f", "kernel B70f"},
                  "Convolution Kernel (0018,1210)"},
        Attribute{"Thickness",
                  [](int n) { return put(DCM_SliceThickness, n == 0   ? "0.75"
                                                             : n == 1 ? "2"
                                                                      : "10"); },
                  {"slices 0.75 mm thick", "slices 2 mm thick", "slices 10 mm thick"},
                  "Slice Thickness (0018,0050)"},
        Attribute{
            "Energy",
            [](int n) { return put(DCM_ImageType, "DERIVED\\PRIMARY\\AXIAL\\VMI " + std::to_string(40 + 50 * n)); },
            {"image type DERIVED\\PRIMARY\\AXIAL\\VMI 40", "image type DERIVED\\PRIMARY\\AXIAL\\VMI 90",
             "image type DERIVED\\PRIMARY\\AXIAL\\VMI 140"},
            "Image Type (0008,0008)"},
        Attribute{"Contrast",
                  [](int n) { return put(DCM_ContrastBolusAgent, n == 0   ? ""
                                                                 : n == 1 ? "early"
                                                                          : "late"); },
                  {"no Contrast/Bolus Agent", "contrast agent early", "contrast agent late"},
                  "Contrast/Bolus Agent (0018,0010)"},
        Attribute{"Clock",
                  [](int n) {
                    return [n](DcmDataset& data) {
                      data.putAndInsertString(DCM_AcquisitionDate, n == 0 ? "20180327" : "20180328");
                      data.putAndInsertString(DCM_AcquisitionTime, n == 0   ? "235959"
                                                                   : n == 1 ? "000001.50"
                                                                            : "000002.000000");
                    };
                  },
                  {"acquired 2018-03-27 23:59:59", "acquired 2018-03-28 00:00:01.5", "acquired 2018-03-28 00:00:02"},
                  "Acquisition Date and Time (0008,0022) (0008,0032)"}),
    [](const auto& tested) { return tested.param.name; });

TEST(DicomSplit, WhatSaysOutrightWhichVolumeItIsComesBeforeHowAndWhenItWasMade) {
  Folder folder;
  for (int n = 0; n < 2; ++n) {
    folder.write(0, 4,
                 {put(DCM_AcquisitionNumber, std::to_string(n)), put(DCM_ConvolutionKernel, n ? "A" : "B"),
                  put(DCM_TemporalPositionIdentifier, std::to_string(n + 1))});
  }
  EXPECT_EQ(folder.labels(), (Labels{"time point 1", "time point 2"}));
}

TEST(DicomSplit, TwoAttributesTogetherDivideWhatNeitherDoes) {
  Folder folder;
  for (const char* kernel : {"soft", "sharp"}) {
    for (const char* phase : {"0%", "50%", "90%"})
      folder.write(0, 3, {put(DCM_ConvolutionKernel, kernel), put(DCM_SeriesDescription, phase)});
  }
  EXPECT_EQ(folder.labels(),
            (Labels{"phase 0 %, kernel sharp", "phase 0 %, kernel soft", "phase 50 %, kernel sharp",
                    "phase 50 %, kernel soft", "phase 90 %, kernel sharp", "phase 90 %, kernel soft"}));
  EXPECT_EQ(folder.series()[0].split_by, "Series Description (0008,103E) and Convolution Kernel (0018,1210)");
}

TEST(DicomSplit, OneDoubledSliceIsRefusedWithWhatWasTried) {
  Folder folder;
  folder.write(0, 9, {put(DCM_AcquisitionNumber, "1")});
  folder.write(4, 4, {put(DCM_AcquisitionNumber, "2")});
  EXPECT_TRUE(is_one_refused_volume(folder, {"2 slices at the same position", "s1005.dcm", "s1011.dcm",
                                             "(Acquisition Number (0020,0012) gives a volume of one slice"}));
}

TEST(DicomSplit, SlicesThatNothingTellsApartAreRefused) {
  Folder folder;
  folder.numbered = false;
  folder.write(0, 4, {});
  folder.write(0, 4, {});
  EXPECT_TRUE(is_one_refused_volume(folder, {"2 slices at the same position", "likewise at 4 other positions",
                                             "no attribute that may tell volumes apart differs"}));
}

TEST(DicomSplit, ClockTicksThatCutAVolumeInPiecesDivideNothing) {
  Folder folder;
  const auto at = [](int second) { return put(DCM_ContentTime, "12000" + std::to_string(second)); };
  folder.numbered = false;
  folder.write(0, 3, {at(0)});
  folder.write(4, 7, {at(1)});
  folder.write(0, 3, {at(2)});
  folder.write(4, 7, {at(3)});
  EXPECT_TRUE(is_one_refused_volume(
      folder,
      {"2 slices at the same position", "Content Date and Time (0008,0023) (0008,0033) gives pieces of a volume"}));
}

TEST(DicomSplit, ABlockThatWasScannedAgainIsAVolumeOfItsOwn) {
  Folder folder;
  folder.write(0, 9, {put(DCM_AcquisitionNumber, "1")});
  folder.write(4, 6, {put(DCM_AcquisitionNumber, "2")});
  const std::vector<DicomSeries> series = folder.series();
  ASSERT_EQ(series.size(), 2u);
  EXPECT_EQ(series[0].geometry.size.z, 10);
  EXPECT_EQ(series[1].geometry.size.z, 3);
  EXPECT_EQ(series[1].label, "acquisition 2");
}

TEST(DicomSplit, BlocksThatOverlapAreVolumesWhetherTheirSlicesCoincideOrNot) {
  for (const double shift : {0.0, 0.9}) {
    Folder folder;
    folder.write(0, 11, {put(DCM_AcquisitionNumber, "1")});
    folder.write(8, 20, {put(DCM_AcquisitionNumber, "2")}, shift);
    const std::vector<DicomSeries> series = folder.series();
    ASSERT_EQ(series.size(), 2u) << shift;
    EXPECT_EQ(series[0].refusal, std::nullopt);
    EXPECT_EQ(series[0].geometry.size.z, 12);
    EXPECT_EQ(series[1].geometry.size.z, 13);
    EXPECT_EQ(series[1].geometry.origin.z, 50 + shift);
  }
}

TEST(DicomSplit, BlocksThatLieApartAreNotDivided) {
  Folder folder;
  folder.write(0, 5, {put(DCM_AcquisitionNumber, "1")});
  folder.write(8, 12, {put(DCM_AcquisitionNumber, "2")});
  const std::vector<DicomSeries> series = folder.series();
  ASSERT_EQ(series.size(), 1u);
  EXPECT_TRUE(says(series[0].uneven.value_or(""), {"slice gap 7.5 mm", "2.5 mm elsewhere"}));
}

TEST(DicomSplit, APhaseWithoutOneSliceIsUnevenAlone) {
  Folder folder;
  for (int phase = 0; phase < 4; ++phase) {
    folder.write(0, 2, {put(DCM_AcquisitionNumber, std::to_string(phase))});
    folder.write(phase == 2 ? 4 : 3, 7, {put(DCM_AcquisitionNumber, std::to_string(phase))});
  }
  const std::vector<DicomSeries> series = folder.series();
  ASSERT_EQ(series.size(), 4u);
  for (int phase = 0; phase < 4; ++phase) EXPECT_EQ(series[phase].uneven.has_value(), phase == 2);
  EXPECT_TRUE(says(series[2].uneven.value_or(""), {"slice gap 5 mm", "1 slice missing"}));
}

TEST(DicomSplit, InstanceNumbersThatRunThroughAllPositionsAgainTellVolumesApart) {
  Folder folder;
  folder.write(0, 4, {});
  folder.write(0, 4, {});
  folder.write(0, 4, {});
  EXPECT_EQ(folder.labels(), (Labels{"images 1 to 5", "images 6 to 10", "images 11 to 15"}));
  EXPECT_EQ(folder.series()[1].slices[0].instance_number, 6);
}

TEST(DicomSplit, InstanceNumbersThatCountAtEachPositionTellNothing) {
  Folder folder;
  for (int k = 0; k < 5; ++k) {
    for (int phase = 0; phase < 3; ++phase) folder.write(k, k, {});
  }
  EXPECT_TRUE(is_one_refused_volume(folder, {"3 slices at the same position"}));
}

TEST(DicomSplit, FoldersTellVolumesApartThatNothingElseDoes) {
  Folder folder;
  folder.numbered = false;
  folder.write(0, 4, {}, 0, "ph 0");
  folder.write(0, 4, {}, 0, "ph\n9");
  const Labels labels = folder.labels();
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_TRUE(labels[0].ends_with("/ph\\x0a9")) << labels[0];
  EXPECT_TRUE(labels[1].ends_with("/ph 0")) << labels[1];
}

TEST(DicomSplit, PlanesSizesPixelsAndFramesOfReferenceAreVolumesIfThereAreThreeSlicesOfEach) {
  struct Case {
    std::function<void(MadeSlice&)> change;
    Labels labels;
    std::string split_by;
  };
  const std::vector<Case> cases = {
      {[](MadeSlice& s) { s.orientation = "1\\0\\0\\0\\0\\-1"; },
       {"axial", "coronal"},
       "Image Orientation (0020,0037)"},
      {[](MadeSlice& s) { s.orientation = "0\\1\\0\\1\\0\\0"; },
       {"axial (1\\0\\0\\0\\1\\0)", "axial (0\\1\\0\\1\\0\\0)"},
       "Image Orientation (0020,0037)"},
      {[](MadeSlice& s) { s.rows = 5; }, {"4 x 6", "5 x 6"}, "Rows x Columns"},
      {[](MadeSlice& s) { s.spacing = "0.75\\0.51"; },
       {"pixels of 0.75 x 0.5 mm", "pixels of 0.75 x 0.51 mm"},
       "Pixel Spacing (0028,0030)"},
      {[](MadeSlice& s) { s.frame = "1.2.5"; },
       {"frame of reference 1.2.4", "frame of reference 1.2.5"},
       "Frame of Reference UID (0020,0052)"},
  };
  // Whichever files come first, the volumes are numbered alike.
  const auto check = [](const Case& one, bool changed_first) {
    const Scratch folder;
    write_stack(folder.path(), 10, [&](int k, MadeSlice& slice) {
      if ((k < 5) != changed_first) return;
      one.change(slice);
      slice.position = std::to_string(-10 - k) + "\\" + std::to_string(-20 - k) + "\\" + std::to_string(30 + 2.5 * k);
      if (slice.orientation == "1\\0\\0\\0\\1\\0") slice.position = "-10\\-20\\" + std::to_string(30 + 2.5 * k);
    });
    const std::vector<DicomSeries> series = scan_dicom(folder.path()).series;
    ASSERT_EQ(series.size(), 2u) << one.split_by;
    EXPECT_EQ((Labels{series[0].label, series[1].label}), one.labels);
    EXPECT_EQ(series[0].split_by, one.split_by);
    EXPECT_EQ(series[0].refusal, std::nullopt);
    EXPECT_EQ(series[0].slices.size(), 5u);
  };
  for (const Case& one : cases) {
    check(one, false);
    check(one, true);
  }
}

TEST(DicomSplit, APatientsNameInTheDescriptionIsNeverShown) {
  Folder folder;
  for (const char* text : {"first of Secret", "second of Secret"})
    folder.write(0, 4, {put(DCM_SeriesDescription, text)});
  EXPECT_EQ(folder.labels(), (Labels{"Series Description no. 1", "Series Description no. 2"}));
  EXPECT_EQ(folder.series()[0].description, "");
  Folder by_id;
  by_id.write(0, 4, {put(DCM_SeriesDescription, "scan of SECRET-ID.")});
  EXPECT_EQ(by_id.series()[0].description, "");
  Folder in_doubt;  // a word that begins as the name does may be the name, with what was put behind it
  in_doubt.write(0, 4, {put(DCM_SeriesDescription, "SECRETION 5 mm")});
  EXPECT_EQ(in_doubt.series()[0].description, "");
  Folder harmless;
  harmless.write(0, 4, {put(DCM_SeriesDescription, "Lung 5 mm")});
  EXPECT_EQ(harmless.series()[0].description, "Lung 5 mm");
}

TEST(DicomSplit, KernelsThatAlternateInAnEvenStackAreToldAsWarning) {
  Folder folder;
  for (int k = 0; k < 6; ++k) folder.write(k, k, {put(DCM_ConvolutionKernel, k % 2 ? "B30s" : "B60f")});
  const std::vector<DicomSeries> series = folder.series();
  ASSERT_EQ(series.size(), 1u);
  EXPECT_EQ(series[0].refusal, std::nullopt);
  ASSERT_EQ(series[0].warnings.size(), 1u);
  EXPECT_TRUE(
      says(series[0].warnings[0], {"Convolution Kernel (0018,1210) differs", "kernel B60f in ", "kernel B30s in "}));
}

TEST(DicomSplit, VolumesComeInTheOrderOfTheirSeriesAndThenTheirOwn) {
  const Scratch scratch;
  for (const auto& [name, number] : {std::pair{"one", 9}, {"two", 2}}) {
    for (int phase = 2; phase > 0; --phase) {
      write_stack(scratch / (name + std::to_string(phase)), 4, [&, n = name, no = number](int k, MadeSlice& slice) {
        slice.series = std::string("1.2.3.") + n;
        slice.series_number = no;
        slice.sop_instance = "1." + std::to_string(no) + "." + std::to_string(phase) + "." + std::to_string(k);
        slice.edit = put(DCM_AcquisitionNumber, std::to_string(phase));
      });
    }
  }
  const std::vector<DicomSeries> series = scan_dicom(scratch.path()).series;
  ASSERT_EQ(series.size(), 4u);
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_EQ(series[n].series_uid, n < 2 ? "1.2.3.two" : "1.2.3.one");
    EXPECT_EQ(series[n].label, n % 2 ? "acquisition 2" : "acquisition 1");
  }
}

}  // namespace
}  // namespace tetwarp
