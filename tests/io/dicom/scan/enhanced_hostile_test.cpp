// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Enhanced CT that is damaged, or made to do harm.
#include <gtest/gtest.h>

#include <malloc.h>

#include <chrono>
#include <fstream>

#include "deform/errors.h"
#include "io/dicom_series.h"
#include "tests/support/dicom/encapsulated.h"
#include "tests/support/dicom/enhanced_maker.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

class HostileEnhancedCt : public testing::Test {
 protected:
  void write(const MadeEnhanced& made, int frames = 5) { made.write(file_, classic_stack(frames)); }
  void write(const std::function<void(DcmDataset&)>& edit) {
    MadeEnhanced made;
    made.edit = edit;
    write(made);
  }
  void write_groups(const std::function<void(int, DcmItem&)>& edit) {
    MadeEnhanced made;
    made.edit_groups = edit;
    write(made);
  }
  /// Why the one series of the file is no volume, or cannot be loaded.
  std::string refusal() const {
    const DicomScan scan = scan_dicom(file_);
    if (scan.series.size() != 1) return scan.skipped.empty() ? "no series" : scan.skipped.front().reason;
    if (scan.series.front().refusal) return *scan.series.front().refusal;
    try {
      load_dicom(scan.series.front());
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }

  const Scratch folder_;
  const fs::path file_ = folder_ / "all.dcm";
};

TEST_F(HostileEnhancedCt, NumberOfFramesThatNoFileHoldsIsRefused) {
  for (const char* number :
       {"1000000000", "2147483647", "0", "-3", "many", "99999999999999999999", "", "1e9", "100001"}) {
    write([&](DcmDataset& data) { data.putAndInsertString(DCM_NumberOfFrames, number); });
    const std::string text = number;  // text that is no number is not shown: it could be anything
    const bool is_text = text == "many" || text.size() > 12;
    const std::string why = refusal();
    EXPECT_TRUE(says(why, {"Number of Frames (0028,0008), expected 1 to 100000, found", "all.dcm"})) << text;
    EXPECT_TRUE(says(why, {is_text ? std::string("no number") : text})) << text;
  }
}

TEST_F(HostileEnhancedCt, GroupsOfMoreOrFewerFramesAreRefused) {
  for (const auto& [number, found] : {std::pair{"4", "found 5"}, {"6", "found 5"}, {"100000", "found 5"}}) {
    write([&, text = number](DcmDataset& data) { data.putAndInsertString(DCM_NumberOfFrames, text); });
    EXPECT_TRUE(says(refusal(), {"(5200,9230)", number, found, "all.dcm"}));
  }
  write([](DcmDataset& data) { data.findAndDeleteElement(DCM_PerFrameFunctionalGroupsSequence); });
  EXPECT_TRUE(says(refusal(), {"(5200,9230)", "expected 5", "found 0"}));
}

TEST_F(HostileEnhancedCt, GroupsThatAreNoSequencesCountAsMissing) {
  write([](DcmDataset& data) {
    data.findAndDeleteElement(DCM_PerFrameFunctionalGroupsSequence);
    data.insert(new DcmLongText(DcmTag(DCM_PerFrameFunctionalGroupsSequence, EVR_LT)));
  });
  EXPECT_TRUE(says(refusal(), {"(5200,9230)", "found 0"}));
  write_groups([](int k, DcmItem& groups) {
    if (k != 3) return;
    groups.findAndDeleteElement(DCM_PlanePositionSequence);
    groups.insert(new DcmLongText(DcmTag(DCM_PlanePositionSequence, EVR_LT)));
  });
  EXPECT_TRUE(says(refusal(), {"Image Position", "missing", "all.dcm, frame 4"}));
}

TEST_F(HostileEnhancedCt, MissingGroupNamesTheFrame) {
  struct Case {
    DcmTagKey sequence;
    std::string attribute;
  };
  for (const Case& one :
       {Case{DCM_PlanePositionSequence, "Image Position"}, Case{DCM_PlaneOrientationSequence, "Image Orientation"},
        Case{DCM_PixelMeasuresSequence, "Pixel Spacing"},
        Case{DCM_PixelValueTransformationSequence, "Rescale Slope"}}) {
    write_groups([&](int k, DcmItem& groups) {
      if (k == 2) groups.findAndDeleteElement(one.sequence);
    });
    EXPECT_TRUE(says(refusal(), {one.attribute, "missing", "all.dcm, frame 3"}));
    write_groups([&](int, DcmItem& groups) {
      groups.findAndDeleteElement(one.sequence);
      DcmItem* item = nullptr;
      groups.findOrCreateSequenceItem(one.sequence, item, 0);
    });
    EXPECT_TRUE(says(refusal(), {one.attribute, "missing", "all.dcm, frame 1", "4 more of 5 frames likewise"}));
  }
}

TEST_F(HostileEnhancedCt, FramesAtOnePositionAreNamed) {
  write_groups([](int k, DcmItem& groups) {
    if (k == 3)
      macro_of(groups, DCM_PlanePositionSequence).putAndInsertString(DCM_ImagePositionPatient, "-10\\-20\\32.5");
  });
  EXPECT_TRUE(says(refusal(), {"2 slices at the same position", "all.dcm, frame 2, ", "all.dcm, frame 4"}));
}

TEST_F(HostileEnhancedCt, ValuesOfTheWrongKindAreRefusedOrIgnored) {
  write_groups([](int, DcmItem& groups) {
    macro_of(groups, DCM_PlanePositionSequence).putAndInsertString(DCM_ImagePositionPatient, "here");
  });
  EXPECT_TRUE(says(refusal(), {"Image Position", "malformed"}));
  write_groups([](int, DcmItem& groups) {
    DcmItem& content = macro_of(groups, DCM_FrameContentSequence);
    content.findAndDeleteElement(DCM_FrameAcquisitionNumber);
    auto* number = new DcmLongText(DcmTag(DCM_FrameAcquisitionNumber, EVR_LT));
    number->putString("one");
    content.insert(number);
    auto* indices = new DcmOtherByteOtherWord(DcmTag(DCM_DimensionIndexValues, EVR_OB));
    indices->putUint8Array(reinterpret_cast<const Uint8*>("abc"), 3);
    content.insert(indices);
    macro_of(groups, DCM_CTExposureSequence).putAndInsertString(DCM_ExposureInmAs, "1e300");
  });
  EXPECT_EQ(refusal(), "accepted");
}

TEST_F(HostileEnhancedCt, TruncatedPixelDataNameTheFirstFrameThatIsNotWhole) {
  write(MadeEnhanced());
  const std::uint64_t frame_bytes = 4 * 6 * 2;
  fs::resize_file(file_, fs::file_size(file_) - frame_bytes - 4);
  EXPECT_TRUE(
      says(refusal(), {"Pixel Data is truncated", "all.dcm, frame 4", "expected 48", "found 44", "1 more of 5"}));
}

TEST_F(HostileEnhancedCt, FileThatWasCutAfterItWasListedIsRefused) {
  write(MadeEnhanced());
  const DicomScan scan = scan_dicom(file_);
  fs::resize_file(file_, fs::file_size(file_) - 60);
  EXPECT_THROW(load_dicom(scan.series.front()), InputError);
  write(MadeEnhanced(), 3);
  EXPECT_THROW(load_dicom(scan.series.front()), InputError);
}

TEST_F(HostileEnhancedCt, FileThatEndsWithinItsGroupsIsRefused) {
  write(MadeEnhanced());
  const std::uint64_t size = fs::file_size(file_);
  for (const double part : {0.9, 0.6, 0.3}) {
    write(MadeEnhanced());
    fs::resize_file(file_, static_cast<std::uint64_t>(part * static_cast<double>(size - 240)));
    EXPECT_NE(refusal(), "accepted") << part;
  }
}

TEST_F(HostileEnhancedCt, PixelsThatNoFileOfThisSizeUnfoldsToAreRefusedBeforeMemoryIsAskedFor) {
  MadeEnhanced made;
  made.edit = [](DcmDataset& data) {
    data.putAndInsertUint16(DCM_Rows, 16384);
    data.putAndInsertUint16(DCM_Columns, 16384);
  };
  const std::unique_ptr<DcmDataset> data = made.of(classic_stack(400));
  const std::string start = file_start(UID_RLELosslessTransferSyntax) + attributes_of(*data);
  write_file(file_, start + encapsulated(std::vector<std::string>(400, std::string(2000, '\0'))));
  EXPECT_TRUE(says(refusal(), {"Rows x Columns 16384 x 16384 of 400 frames cannot come from a file of"}));
}

/// "VmRSS:" or "VmHWM:" of this process, MiB.
long status_mib(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    long kib = 0;
    if (key == name && status >> kib) return kib / 1024;
  }
  return -1;
}

/// How much more memory than before a call takes at its peak, MiB.
long peak_growth(const std::function<void()>& call) {
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";  // forgets the peak
  const long before = status_mib("VmRSS:");
  call();
  return status_mib("VmHWM:") - before;
}

/// A file of so many empty items of Per-Frame Functional Groups.
void write_items(const fs::path& path, std::size_t items, const std::string& number_of_frames) {
  MadeEnhanced made;
  made.edit = [&](DcmDataset& data) {
    data.putAndInsertString(DCM_NumberOfFrames, number_of_frames.c_str());
    data.findAndDeleteElement(DCM_PerFrameFunctionalGroupsSequence);
  };
  std::string bytes = file_start(UID_LittleEndianExplicitTransferSyntax) + attributes_of(*made.of(classic_stack(1)));
  append_element(bytes, 0x5200, 0x9230, "SQ", static_cast<std::uint32_t>(8 * items));
  for (std::size_t n = 0; n < items; ++n) append_element(bytes, 0xfffe, 0xe000, "", 0);
  append_element(bytes, 0x7fe0, 0x0010, "OW", 48);
  write_file(path, bytes + std::string(48, '\1'));
}

TEST_F(HostileEnhancedCt, AMillionItemsAreRefusedWithinSomeHundredMebibytes) {
  write_items(file_, 1'000'000, "1000000");
  EXPECT_TRUE(says(refusal(), {"Number of Frames", "found 1000000"}));
  write_items(file_, 1'000'000, "5");
  const long growth = peak_growth([&] {
    EXPECT_TRUE(says(refusal(), {"(5200,9230)", "expected 5", "found 1000000"}));
  });
  EXPECT_LT(growth, 600);
  RecordProperty("mebibytes", std::to_string(growth));
}

TEST_F(HostileEnhancedCt, SharedAttributesWithoutEndAreNotCopiedForEachFrame) {
  write([](DcmDataset& data) {
    for (int n = 0; n < 3000; ++n) {
      DcmItem* item = nullptr;
      data.findOrCreateSequenceItem(DCM_RequestAttributesSequence, item, -2);
      item->putAndInsertString(DCM_ScheduledProcedureStepID, "1");
    }
  });
  EXPECT_TRUE(says(refusal(), {"too many attributes", "at most 5000", "all.dcm"}));
  write([](DcmDataset& data) {
    for (int n = 0; n < 3000; ++n) {
      DcmItem* item = nullptr;  // references are often many, and are no part of a slice
      data.findOrCreateSequenceItem(DCM_ReferencedImageEvidenceSequence, item, -2);
      item->putAndInsertString(DCM_StudyInstanceUID, "1.2");
    }
  });
  EXPECT_EQ(refusal(), "accepted");
}

TEST_F(HostileEnhancedCt, AMillionValuesOfADateAreReadInOneGo) {
  write([](DcmDataset& data) { data.putAndInsertString(DCM_SeriesDate, std::string((1 << 20) - 2, '\\').c_str()); });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(refusal(), "accepted");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
}

TEST_F(HostileEnhancedCt, TenThousandFramesAreListedInLittleMemory) {
  MadeEnhanced made{.all_shared = true};
  made.write(file_, classic_stack(10'000));
  DicomScan scan;
  const long growth = peak_growth([&] { scan = scan_dicom(file_); });
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(scan.series.front().slices.size(), 10'000u);
#ifndef __SANITIZE_ADDRESS__  // which keeps what was freed
  EXPECT_LT(growth, 150);
#endif
  RecordProperty("mebibytes", std::to_string(growth));
}

}  // namespace
}  // namespace tetwarp
