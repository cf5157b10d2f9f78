// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom_segmentation.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "io/dicom/scan/dicom_header.h"
#include "tests/support/dicom/encapsulated.h"
#include "tests/support/dicom/encoders.h"
#include "tests/support/dicom/seg_maker.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

/// Two that overlap: the first in slices 0 and 2, the second in 1 and 2.
int two_organs(int segment, int i, int j, int k) {
  if (segment == 0) return k != 1 && (i + j) % 3 == 0 ? 1 : 0;
  return k > 0 && i >= 2 && j >= 1 ? 1 : 0;
}

TEST(Segmentation, EachSegmentIsAVolumeAndMissingFramesAreEmpty) {
  const Scratch scratch;
  for (const bool fractional : {false, true}) {
    const int scale = fractional ? 100 : 1;
    const MadeSeg made{.fractional = fractional, .segments = {7, 3}, .value = [&](int n, int i, int j, int k) {
                         return two_organs(n, i, j, k) * (scale - (fractional ? i : 0));
                       }};
    made.write(scratch / "seg");
    ASSERT_TRUE(is_dicom_segmentation(scratch / "seg"));
    const DicomSegmentation seg = read_segmentation_header(scratch / "seg");
    EXPECT_EQ(seg.geometry, (Geometry{{6, 4, 5}, {0.5, 0.75, 2.5}, {-10, -20, 27.5}, glm::dmat3(1)}));
    EXPECT_EQ(seg.fractional, fractional);
    EXPECT_EQ(seg.largest, fractional ? 255 : 1);
    EXPECT_EQ(seg.frame_of_reference_uid, "1.2.4");
    ASSERT_EQ(seg.segments.size(), 2U);
    EXPECT_EQ(seg.segments[0].number, 7);
    EXPECT_EQ(seg.segments[1].label, "Organ 3");
    EXPECT_EQ(seg.frames.size(), 4U);
    const std::vector<AnyVolume> volumes = read_segments(scratch / "seg", seg);
    ASSERT_EQ(volumes.size(), 2U);
    for (int n = 0; n < 2; ++n) {
      const auto voxels = volumes[static_cast<std::size_t>(n)].as<std::uint8_t>();
      for (int at = 0; at < 6 * 4 * 5; ++at) {
        const int i = at % 6, j = at / 6 % 4, k = at / 24 - 1;
        const int expected = k < 0 || k > 2 ? 0 : made.value(n, i, j, k);
        ASSERT_EQ(int{voxels[static_cast<std::size_t>(at)]}, expected) << n << " " << i << " " << j << " " << k;
      }
    }
  }
}

TEST(Segmentation, SlicesAreAsFarApartAsTheFileSaysElseAsTheSeriesElseAsTheClosestFrames) {
  const Scratch scratch;
  const auto outer = [](int, int, int, int k) { return k % 2 == 0 ? 1 : 0; };  // 5 mm apart
  MadeSeg{.value = outer}.write(scratch / "stated");
  EXPECT_EQ(read_segmentation_header(scratch / "stated").geometry.spacing.z, 2.5);
  EXPECT_EQ(read_segmentation_header(scratch / "stated").geometry.size.z, 5);
  MadeSeg{.value = outer, .spacing_between = ""}.write(scratch / "not");
  EXPECT_EQ(read_segmentation_header(scratch / "not", 1.25).geometry.spacing.z, 1.25);
  EXPECT_EQ(read_segmentation_header(scratch / "not", 1.3).geometry.spacing.z, 5);
  EXPECT_EQ(read_segmentation_header(scratch / "not").geometry.size.z, 4);
  MadeSeg{.slices = 1, .value = outer, .spacing_between = ""}.write(scratch / "one");
  EXPECT_EQ(read_segmentation_header(scratch / "one").geometry.spacing.z, 3);  // Slice Thickness
  EXPECT_EQ(read_segmentation_header(scratch / "one", 2).geometry.spacing.z, 2);
}

DcmItem& frame_of(DcmDataset& data, long n) {
  DcmItem* item = nullptr;
  if (data.findAndGetSequenceItem(DCM_PerFrameFunctionalGroupsSequence, item, n).bad())
    throw std::runtime_error("none");
  return *item;
}

void move_frame(DcmDataset& data, long n, const std::string& position) {
  DcmItem* plane = nullptr;
  frame_of(data, n).findAndGetSequenceItem(DCM_PlanePositionSequence, plane);
  MadeSeg::text(*plane, DCM_ImagePositionPatient, position);
}

TEST(Segmentation, NumberOfFramesIsANumberHoweverItIsWritten) {
  const Scratch scratch;
  for (const char* stated : {"4", "04", "+4 "}) {
    MadeSeg{.value = two_organs, .edit = [=](DcmDataset& data) { MadeSeg::text(data, DCM_NumberOfFrames, stated); }}
        .write(scratch / "seg");
    EXPECT_EQ(read_segmentation_header(scratch / "seg").frames.size(), 4U) << stated;
  }
}

TEST(Segmentation, FarMoreVolumeThanPixelsIsRefused) {
  const Scratch scratch;
  MadeSeg made{.slices = 2000, .value = [](int n, int, int, int k) { return n == 0 && k % 1999 == 0 ? 1 : 0; }};
  made.write(scratch / "two");
  EXPECT_THROW(read_segmentation_header(scratch / "two"), InputError);  // 2 x 2002 slices for 2 frames of bits
  made.segments = {1};
  made.write(scratch / "one");
  EXPECT_EQ(read_segmentation_header(scratch / "one").geometry.size.z, 2002);
}

TEST(Segmentation, WhatIsNotOnOneEvenGridOrCutShortOrContradictsItselfIsRefused) {
  const Scratch scratch;
  const auto refused = [&](const char* names, const std::function<void(DcmDataset&)>& edit, bool fractional = false) {
    MadeSeg{.fractional = fractional, .value = two_organs, .edit = edit}.write(scratch / "seg");
    try {
      read_segments(scratch / "seg", read_segmentation_header(scratch / "seg"));
      FAIL() << names;
    } catch (const InputError& error) {
      EXPECT_TRUE(says(error.what(), {names, (scratch / "seg").string()}));
    }
  };
  refused("(0028,0100) BitsAllocated 8", [](DcmDataset& data) { MadeSeg::word(data, DCM_BitsAllocated, 8); });
  refused(
      "(0028,0101) BitsStored 16", [](DcmDataset& data) { MadeSeg::word(data, DCM_BitsStored, 16); }, true);
  refused(
      "PixelRepresentation 1, expected 0", [](DcmDataset& data) { MadeSeg::word(data, DCM_PixelRepresentation, 1); },
      true);
  refused("no rotation: expected lengths 1, 1 and product 0, found 1, 0.9 and 0", [](DcmDataset& data) {
    for (long n = 0; n < 4; ++n)
      MadeSeg::text(MadeSeg::append(frame_of(data, n), DCM_PlaneOrientationSequence), DCM_ImageOrientationPatient,
                    "1\\0\\0\\0\\0.9\\0");
  });
  refused("LABELMAP, expected BINARY or FRACTIONAL",
          [](DcmDataset& data) { MadeSeg::text(data, DCM_SegmentationType, "LABELMAP"); });
  refused("(0062,0001) no known value,", [](DcmDataset& data) { MadeSeg::text(data, DCM_SegmentationType, "SECRET"); });
  refused(
      "above (0062,000e)",
      [](DcmDataset& data) {
        MadeSeg::word(data, DCM_MaximumFractionalValue, 1);
        Uint8 pixels[96] = {0, 0, 2};
        data.putAndInsertUint8Array(DCM_PixelData, pixels, 96);
      },
      true);
  refused("not on an even grid", [](DcmDataset& data) { move_frame(data, 1, "-10\\-20\\33.5"); });
  refused("above one another", [](DcmDataset& data) { move_frame(data, 1, "-9\\-20\\32.5"); });
  refused("twice", [](DcmDataset& data) { move_frame(data, 2, "-10\\-20\\30"); });
  refused("ImagePositionPatient", [](DcmDataset& data) { move_frame(data, 2, "-10\\-20"); });
  refused("at most 2500", [](DcmDataset& data) { move_frame(data, 3, "-10\\-20\\25030"); });
  refused("Number of Frames", [](DcmDataset& data) { MadeSeg::text(data, DCM_NumberOfFrames, "5"); });
  refused("(0028,0008) no number,", [](DcmDataset& data) { MadeSeg::text(data, DCM_NumberOfFrames, "SECRET"); });
  refused("cut short", [](DcmDataset& data) {
    Uint8 pixels[10] = {};
    data.putAndInsertUint8Array(DCM_PixelData, pixels, 10);
  });
  refused("Pixel Data", [](DcmDataset& data) { data.findAndDeleteElement(DCM_PixelData); });
  refused("parallel", [](DcmDataset& data) {
    MadeSeg::text(MadeSeg::append(frame_of(data, 2), DCM_PlaneOrientationSequence), DCM_ImageOrientationPatient,
                  "0\\1\\0\\-1\\0\\0");
  });
  refused("does not describe", [](DcmDataset& data) {
    DcmItem* segment = nullptr;
    data.findAndGetSequenceItem(DCM_SegmentSequence, segment, 1);
    MadeSeg::word(*segment, DCM_SegmentNumber, 9);
  });
  refused("two segments", [](DcmDataset& data) {
    DcmItem* segment = nullptr;
    data.findAndGetSequenceItem(DCM_SegmentSequence, segment, 1);
    MadeSeg::word(*segment, DCM_SegmentNumber, 1);
  });
  refused("SharedFunctionalGroups",
          [](DcmDataset& data) { data.findAndDeleteElement(DCM_SharedFunctionalGroupsSequence); });
  refused("no DICOM segmentation", [](DcmDataset& data) { MadeSeg::text(data, DCM_SOPClassUID, UID_CTImageStorage); });
}

TEST(Segmentation, OfALabelMapEachLabelIsASegment) {
  const Scratch scratch;
  for (const int bits : {8, 16}) {
    const std::vector<int> numbers = bits == 8 ? std::vector{7, 3} : std::vector{700, 65535};
    MadeSeg made{.label_bits = bits, .segments = numbers, .value = two_organs};
    made.write(scratch / "seg");
    ASSERT_TRUE(is_dicom_segmentation(scratch / "seg"));
    const DicomSegmentation seg = read_segmentation_header(scratch / "seg");
    EXPECT_TRUE(seg.label_map);
    EXPECT_FALSE(seg.fractional);
    ASSERT_EQ(seg.segments.size(), 2U) << "the background is none";
    EXPECT_EQ(seg.segments[1].number, numbers[1]);
    EXPECT_EQ(seg.frames.size(), 3U);
    const std::vector<AnyVolume> volumes = read_segments(scratch / "seg", seg);
    ASSERT_EQ(volumes.size(), 2U);
    for (int at = 0; at < 6 * 4 * 5; ++at) {
      const int i = at % 6, j = at / 6 % 4, k = at / 24 - 1;
      const bool is_inside = k >= 0 && k <= 2, second = is_inside && two_organs(1, i, j, k) != 0,
                 first = is_inside && two_organs(0, i, j, k) != 0 && !second;
      ASSERT_EQ(volumes[0].as<std::uint8_t>()[static_cast<std::size_t>(at)], first ? 1 : 0) << bits << " " << at;
      ASSERT_EQ(volumes[1].as<std::uint8_t>()[static_cast<std::size_t>(at)], second ? 1 : 0) << bits << " " << at;
    }
  }
}

TEST(Segmentation, IsCalledSoInAListOfFilesWhateverItsStorageClass) {
  EXPECT_EQ(kind_name(UID_SegmentationStorage), "a segmentation, SegmentationStorage (1.2.840.10008.5.1.4.1.1.66.4)");
  EXPECT_EQ(kind_name(kLabelMapStorage), "a segmentation, LabelMapSegmentationStorage (1.2.840.10008.5.1.4.1.1.66.7)");
}

TEST(Segmentation, LabelMapsThatContradictThemselvesAreRefused) {
  const Scratch scratch;
  const auto refused = [&](const char* names, const std::function<void(DcmDataset&)>& edit) {
    MadeSeg{.label_bits = 8, .value = two_organs, .edit = edit}.write(scratch / "seg");
    try {
      read_segments(scratch / "seg", read_segmentation_header(scratch / "seg"));
      FAIL() << names;
    } catch (const InputError& error) {
      EXPECT_TRUE(says(error.what(), {names, (scratch / "seg").string()}));
    }
  };
  refused("BINARY, expected LABELMAP", [](DcmDataset& data) { MadeSeg::text(data, DCM_SegmentationType, "BINARY"); });
  refused("BitsStored 4, expected 8", [](DcmDataset& data) { MadeSeg::word(data, DCM_BitsStored, 4); });
  refused("labels twice at one place", [](DcmDataset& data) { move_frame(data, 1, "-10\\-20\\30"); });
  refused("shows segment 9 in frame 1", [](DcmDataset& data) {
    Uint8 pixels[72] = {0, 0, 9};
    data.putAndInsertUint8Array(DCM_PixelData, pixels, 72);
  });
  refused("no segment but the background", [](DcmDataset& data) {
    DcmSequenceOfItems* found = nullptr;
    data.findAndGetSequence(DCM_SegmentSequence, found);
    while (found->card() > 1) delete found->remove(1);
  });
}

/// The voxels of all segments, one after the other.
std::vector<std::uint8_t> all_voxels(const std::filesystem::path& path) {
  std::vector<std::uint8_t> all;
  for (const AnyVolume& volume : read_segments(path, read_segmentation_header(path))) {
    const auto voxels = volume.as<std::uint8_t>();
    all.insert(all.end(), voxels.begin(), voxels.end());
  }
  return all;
}

TEST(Segmentation, CompressedFramesHaveTheValuesOfPlainOnes) {
  register_encoders();
  const Scratch scratch;
  for (const int bits : {0, 8, 16}) {
    MadeSeg made{.fractional = bits == 0, .label_bits = bits, .segments = {7, 3}, .value = two_organs};
    made.write(scratch / "plain");
    const std::vector<std::uint8_t> plain = all_voxels(scratch / "plain");
    EXPECT_GT(std::ranges::count(plain, 1), 10);
    for (const E_TransferSyntax encoding : {EXS_RLELossless, EXS_JPEGLSLossless, EXS_JPEGProcess14SV1}) {
      made.encoding = encoding;
      made.write(scratch / "packed");
      EXPECT_EQ(all_voxels(scratch / "packed"), plain) << bits << " " << encoding;
    }
  }
}

TEST(Segmentation, DamagedCompressedFramesAreRefused) {
  const Scratch scratch;
  std::string attributes;
  MadeSeg{.label_bits = 8, .value = two_organs, .edit = [&](DcmDataset& data) { attributes = attributes_of(data); }}
      .write(scratch / "seg");
  const auto refused = [&](const std::vector<std::string>& fragments, const char* names) {
    write_file(scratch / "seg", file_start(UID_RLELosslessTransferSyntax) + attributes + encapsulated(fragments));
    try {
      all_voxels(scratch / "seg");
      FAIL() << names;
    } catch (const InputError& error) {
      EXPECT_TRUE(says(error.what(), {names, (scratch / "seg").string()}));
    }
  };
  refused({std::string(64, '\0'), std::string(64, '\0'), std::string(64, '\0')}, "RLE");
  refused({std::string(64, '\0'), std::string(64, '\0')}, "2 fragments of 3 frames");
  write_file(scratch / "seg", file_start(UID_RLELosslessTransferSyntax) + attributes);
  EXPECT_THROW(all_voxels(scratch / "seg"), InputError) << "no Pixel Data at all";
  MadeSeg{.slices = 1,
          .label_bits = 8,
          .value = [](int, int, int, int) { return 1; },
          .edit = [&](DcmDataset& data) { attributes = attributes_of(data); }}
      .write(scratch / "seg");
  refused({std::string()}, "0 fragments of 1 frame");
  refused({}, "0 fragments of 1 frame");
}

TEST(Segmentation, ACodingThatMayHaveChangedLabelsIsRefused) {
  register_encoders();
  const Scratch scratch;
  MadeSeg{.label_bits = 8, .value = two_organs, .encoding = EXS_JPEGProcess1}.write(scratch / "seg");
  try {
    all_voxels(scratch / "seg");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_TRUE(says(error.what(), {"a lossless coding is expected, found JPEG Baseline", (scratch / "seg").string()}));
  }
}

TEST(Segmentation, FarMorePixelsThanBytesAreRefused) {
  const Scratch scratch;
  std::string attributes;
  MadeSeg{.label_bits = 8,
          .value = two_organs,
          .edit =
              [&](DcmDataset& data) {
                MadeSeg::word(data, DCM_Rows, 65535);
                MadeSeg::word(data, DCM_Columns, 65535);
                attributes = attributes_of(data);
              }}
      .write(scratch / "seg");
  write_file(scratch / "seg", file_start(UID_RLELosslessTransferSyntax) + attributes +
                                  encapsulated(std::vector(3, std::string(64, '\0'))));
  EXPECT_THROW(all_voxels(scratch / "seg"), InputError);
}

TEST(Segmentation, BitsThatAreCompressedAreRefusedByTheNameOfTheirCoding) {
  const Scratch scratch;
  for (const auto& [uid, name] : {std::pair{UID_RLELosslessTransferSyntax, "RLE Lossless"},
                                  std::pair{UID_JPEG2000LosslessOnlyTransferSyntax, "JPEG 2000"}}) {
    std::string attributes;
    MadeSeg{.value = two_organs, .edit = [&](DcmDataset& data) { attributes = attributes_of(data); }}.write(scratch /
                                                                                                            "seg");
    write_file(scratch / "seg", file_start(uid) + attributes + encapsulated({std::string(64, '\0')}));
    try {
      read_segments(scratch / "seg", read_segmentation_header(scratch / "seg"));
      FAIL() << name;
    } catch (const InputError& error) {
      EXPECT_TRUE(says(error.what(), {"has compressed pixels", name, "plain ones", (scratch / "seg").string()}));
    }
  }
}

}  // namespace
}  // namespace tetwarp
