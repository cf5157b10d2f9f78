// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmdata/dcxfer.h>
#include <dcmtk/dcmjpeg/djencode.h>
#include <dcmtk/dcmjpls/djencode.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "io/dicom/scan/dicom_headers.h"
#include "io/hash.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

DicomVolume load_folder(const fs::path& folder, int threads = 0) {
  const DicomScan scan = scan_dicom(folder);
  if (scan.series.size() != 1) throw std::runtime_error("expected one series");
  return load_dicom(scan.series.front(), threads);
}

/// One slice that holds `words`, read back.
DicomVolume load_words(std::vector<std::uint16_t> words, MadeSlice slice = {}) {
  const Scratch folder;
  slice.rows = 1;
  slice.columns = static_cast<int>(words.size());
  slice.words = std::move(words);
  write_slice(folder / "slice.dcm", slice);
  return load_folder(folder.path());
}

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

using Hu = std::vector<std::int16_t>;
constexpr std::uint16_t operator""_s(unsigned long long value) { return static_cast<std::uint16_t>(0x10000 - value); }

TEST(DicomLoad, EverySliceGoesThroughItsOwnSlopeAndIntercept) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int k, MadeSlice& slice) {
    slice.slope = std::to_string(k + 1);
    slice.intercept = std::to_string(-100 * k);
    slice.words = std::vector<std::uint16_t>(24, 10);
  });
  const DicomVolume loaded = load_folder(folder.path());
  EXPECT_EQ(loaded.volume.voxels[0], 10);
  EXPECT_EQ(loaded.volume.voxels[24], 20 - 100);
  EXPECT_EQ(loaded.volume.voxels[71], 30 - 200);
  EXPECT_EQ(loaded.rounded, 0u);
}

TEST(DicomLoad, VoxelsLieColumnsFirstThenRowsThenSlices) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int k, MadeSlice& slice) {
    for (int i = 0; i < 24; ++i) slice.words.push_back(static_cast<std::uint16_t>(100 * (2 - k) + i));
    slice.position = position_text(0, 0, -k);
    slice.intercept = "0";
  });
  const DicomVolume loaded = load_folder(folder.path());
  for (int i = 0; i < 72; ++i) ASSERT_EQ(loaded.volume.voxels[i], 100 * (i / 24) + i % 24);
}

TEST(DicomLoad, FractionsAreRoundedHalfToEvenAndCounted) {
  MadeSlice slice;
  slice.slope = "0.5";
  slice.intercept = "0";
  const DicomVolume loaded = load_words({1, 2, 3, 5, 1_s, 3_s}, slice);
  EXPECT_EQ(loaded.volume.voxels, (Hu{0, 1, 2, 2, 0, -2}));
  EXPECT_EQ(loaded.rounded, 5u);
}

TEST(DicomLoad, HuBeyondInt16IsRefusedWithItsValue) {
  EXPECT_TRUE(says(error_of([] {
                     load_words({0, 32000_s, 5});
                   }),
                   {"HU beyond int16", "slice.dcm", "stored value -32000 gives -33024 HU"}));
  MadeSlice slice;
  slice.is_signed = false;
  slice.intercept = "0";
  EXPECT_TRUE(says(error_of([&] { load_words({40000}, slice); }), {"stored value 40000 gives 40000 HU"}));
}

TEST(DicomLoad, BitsAboveHighBitAreNoPartOfTheValue) {
  MadeSlice slice;
  slice.intercept = "0";
  slice.bits_stored = 12;
  slice.high_bit = 11;
  slice.is_signed = false;
  EXPECT_EQ(load_words({0xf123, 0x0123, 0x8fff}, slice).volume.voxels, (Hu{0x123, 0x123, 0xfff}));
  slice.is_signed = true;
  EXPECT_EQ(load_words({0x0fff, 0xf7ff, 0x0800}, slice).volume.voxels, (Hu{-1, 2047, -2048}));
  slice.high_bit = 13;
  EXPECT_EQ(load_words({0x3ffc, 0xdfff, 0x2003}, slice).volume.voxels, (Hu{-1, 2047, -2048}));
}

TEST(DicomLoad, EightBitPixelsAreRead) {
  MadeSlice slice;
  slice.bits_allocated = slice.bits_stored = 8;
  slice.high_bit = 7;
  slice.intercept = "0";
  EXPECT_EQ(load_words({255, 0, 128}, slice).volume.voxels, (Hu{-1, 0, -128}));  // an odd number of bytes
  slice.is_signed = false;
  EXPECT_EQ(load_words({255, 0, 128}, slice).volume.voxels, (Hu{255, 0, 128}));
}

TEST(DicomLoad, PaddingIsReadWithTheSignOfThePixels) {
  MadeSlice slice;
  slice.edit = [](DcmDataset& data) {
    delete data.remove(DCM_PixelPaddingValue);
    auto* element = new DcmUnsignedShort(DcmTag(DCM_PixelPaddingValue, EVR_US));
    element->putUint16(63536, 0);
    data.insert(element);
  };
  const DicomVolume loaded = load_words({2000_s, 0}, slice);
  ASSERT_TRUE(loaded.padding);
  EXPECT_EQ(loaded.padding->low, -3024);
  EXPECT_EQ(loaded.padding->high, -3024);
}

TEST(DicomLoad, PaddingRangeReachesFromValueToLimitInEitherOrder) {
  MadeSlice slice;
  slice.is_signed = false;
  slice.slope = "2";
  slice.edit = [](DcmDataset& data) {
    data.putAndInsertUint16(DCM_PixelPaddingValue, 30);
    data.putAndInsertUint16(DCM_PixelPaddingRangeLimit, 10);
  };
  const DicomVolume loaded = load_words({5}, slice);
  ASSERT_TRUE(loaded.padding);
  EXPECT_EQ(loaded.padding->low, -1004);
  EXPECT_EQ(loaded.padding->high, -964);
}

TEST(DicomLoad, PaddingBeyondInt16IsSaturatedNotRefused) {
  MadeSlice slice;
  slice.edit = [](DcmDataset& data) { data.putAndInsertSint16(DCM_PixelPaddingValue, -32768); };
  const DicomVolume loaded = load_words({32768_s, 1024}, slice);
  EXPECT_EQ(loaded.volume.voxels, (Hu{-32768, 0}));
  EXPECT_EQ(loaded.padding->low, -32768);
}

TEST(DicomLoad, PaddingThatSlicesDisagreeOnIsNone) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int k, MadeSlice& slice) {
    slice.edit = [k](DcmDataset& data) {
      if (k != 1) data.putAndInsertSint16(DCM_PixelPaddingValue, -2000);
    };
  });
  EXPECT_FALSE(load_folder(folder.path()).padding);
}

TEST(DicomLoad, Monochrome1KeepsItsHu) {
  MadeSlice slice;
  slice.edit = [](DcmDataset& data) { data.putAndInsertString(DCM_PhotometricInterpretation, "MONOCHROME1"); };
  EXPECT_EQ(load_words({0, 1024}, slice).volume.voxels, (Hu{-1024, 0}));
}

TEST(DicomLoad, HeadersHoldAllButPixelDataInSliceOrder) {
  const Scratch folder;
  write_stack(folder.path(), 4, [](int k, MadeSlice& slice) { slice.position = position_text(0, 0, -k); });
  const DicomVolume loaded = load_folder(folder.path());
  ASSERT_EQ(loaded.headers->slices.size(), 4u);
  for (int k = 0; k < 4; ++k) {
    DcmDataset& header = *loaded.headers->slices[k];
    OFString number, name;
    header.findAndGetOFString(DCM_InstanceNumber, number);
    header.findAndGetOFString(DCM_PatientName, name);
    EXPECT_EQ(number, std::to_string(4 - k).c_str());
    EXPECT_EQ(name, "SECRET^NAME");
    EXPECT_FALSE(header.tagExists(DCM_PixelData));
  }
}

TEST(DicomLoad, HashIsThatOfTheFilesHashesInSliceOrder) {
  const Scratch folder;
  write_stack(folder.path(), 3, [](int k, MadeSlice& slice) { slice.position = position_text(0, 0, -k); });
  Sha256 expected;
  for (const char* name : {"s02.dcm", "s01.dcm", "s00.dcm"}) {
    std::ifstream stream(folder / name, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    expected.add(Sha256().add(std::as_bytes(std::span(bytes))).digest());
  }
  EXPECT_EQ(load_folder(folder.path()).sha256, expected.hex());
}

/// A stack of 100 x 96 slices, more than is converted at once, whose words take all 12 bits.
void write_large_stack(const fs::path& folder, const std::function<void(MadeSlice&)>& change) {
  write_stack(folder, 3, [&](int k, MadeSlice& slice) {
    slice.rows = 96;
    slice.columns = 100;
    for (int i = 0; i < 9600; ++i) slice.words.push_back(static_cast<std::uint16_t>((i * 7919 + k) % 4096));
    change(slice);
  });
}

TEST(DicomLoad, PixelsAreTheSameFromTheFileAndThroughDcmtk) {
  const std::vector<std::function<void(MadeSlice&)>> ways = {
      [](MadeSlice&) {},
      [](MadeSlice& slice) { slice.encoding = EXS_LittleEndianImplicit; },
      [](MadeSlice& slice) { slice.encoding = EXS_BigEndianExplicit; },
      // What follows Pixel Data, or is longer than the slice, is not taken for pixels.
      [](MadeSlice& slice) {
        const std::vector<Uint8> padding(300, 0x55);
        slice.edit = [=](DcmDataset& data) {
          data.putAndInsertUint8Array(DCM_DataSetTrailingPadding, padding.data(), padding.size());
        };
      },
      [](MadeSlice& slice) { slice.words.insert(slice.words.end(), 7, 0x5555); },
  };
  Hu expected;
  for (int n = 0; n < 3 * 9600; ++n)
    expected.push_back(static_cast<std::int16_t>((n % 9600 * 7919 + n / 9600) % 4096 - 1024));
  for (std::size_t way = 0; way < ways.size(); ++way) {
    const Scratch folder;
    write_large_stack(folder.path(), ways[way]);
    const DicomVolume loaded = load_folder(folder.path());
    EXPECT_EQ(loaded.volume.voxels, expected) << way;
    EXPECT_EQ(loaded.headers->slices[1]->tagExists(DCM_DataSetTrailingPadding), way == 3) << way;
    EXPECT_FALSE(loaded.headers->slices[1]->tagExists(DCM_PixelData)) << way;
  }
}

TEST(DicomLoad, PixelsOfMoreRowsThanTheHeaderSaysAreNotCutToThem) {
  for (const E_TransferSyntax encoding :
       {EXS_LittleEndianExplicit, EXS_BigEndianExplicit, EXS_DeflatedLittleEndianExplicit}) {
    const Scratch folder;
    write_large_stack(folder.path(), [&](MadeSlice& slice) {
      slice.encoding = encoding;
      slice.edit = [](DcmDataset& data) { data.putAndInsertUint16(DCM_Rows, 95); };
    });
    EXPECT_TRUE(says(error_of([&] { load_folder(folder.path()); }),
                     {"more Pixel Data than Rows x Columns 95 x 100", "expected 19000 bytes, found 19200"}))
        << encoding;
  }
}

TEST(DicomLoad, PixelsAreFoundWherePixelDataAlsoOccurWithinASequence) {
  const Scratch folder;
  write_large_stack(folder.path(), [](MadeSlice& slice) {
    slice.edit = [](DcmDataset& data) {
      DcmItem* icon = nullptr;
      data.findOrCreateSequenceItem(DCM_IconImageSequence, icon);
      const std::vector<Uint16> words(8, 0x7777);
      icon->putAndInsertUint16Array(DCM_PixelData, words.data(), words.size());
    };
  });
  const DicomVolume loaded = load_folder(folder.path());
  EXPECT_EQ(loaded.volume.voxels[0], -1024);
  EXPECT_EQ(loaded.volume.voxels[1], 7919 % 4096 - 1024);
  EXPECT_TRUE(loaded.headers->slices[0]->tagExists(DCM_IconImageSequence));
}

TEST(DicomLoad, OneWordThatDoesNotFitIsFoundAmongMany) {
  const Scratch folder;
  const auto with_word = [&](bool is_padding) {
    write_large_stack(folder.path(), [&](MadeSlice& slice) {
      slice.words[5000] = 32768_s;
      slice.words[9000] = 32000_s;
      if (is_padding) {
        slice.words[9000] = 32767_s;
        slice.edit = [](DcmDataset& data) {
          data.putAndInsertSint16(DCM_PixelPaddingValue, -32768);
          data.putAndInsertSint16(DCM_PixelPaddingRangeLimit, -32767);
        };
      }
    });
  };
  with_word(false);
  EXPECT_TRUE(says(error_of([&] { load_folder(folder.path()); }), {"s00.dcm", "stored value -32768 gives -33792 HU"}));
  with_word(true);
  const DicomVolume loaded = load_folder(folder.path());
  EXPECT_EQ(loaded.volume.voxels[5000], -32768);
  EXPECT_EQ(loaded.volume.voxels[9000], -32768);
  EXPECT_EQ(loaded.volume.voxels[4999], 4999 * 7919 % 4096 - 1024);
  EXPECT_EQ(loaded.volume.voxels[9599], 9599 * 7919 % 4096 - 1024);
}

TEST(DicomLoad, ResultIsIndependentOfThreadCount) {
  const Scratch folder;
  write_stack(folder.path(), 20, [](int k, MadeSlice& slice) { slice.slope = k % 2 ? "1" : "1.5"; });
  const DicomVolume one = load_folder(folder.path(), 1), many = load_folder(folder.path(), 4);
  EXPECT_EQ(one.volume.voxels, many.volume.voxels);
  EXPECT_EQ(one.rounded, many.rounded);
  EXPECT_EQ(one.sha256, many.sha256);
}

TEST(DicomLoad, FirstBadSliceIsNamedWhateverTheThreads) {
  const Scratch folder;
  write_stack(folder.path(), 20, [](int k, MadeSlice& slice) {
    if (k >= 7) slice.words = {32768_s};
  });
  for (int threads = 1; threads <= 4; ++threads) {
    EXPECT_TRUE(says(error_of([&] { load_folder(folder.path(), threads); }), {"HU beyond int16", "s07.dcm"}));
  }
}

TEST(DicomLoad, FileThatChangedSinceTheScanIsRefused) {
  const std::vector<std::pair<std::function<void(MadeSlice&)>, std::string>> cases = {
      {[](MadeSlice& slice) { slice.sop_instance = "9.9"; }, "SOP Instance UID"},
      {[](MadeSlice& slice) { slice.position = "-10\\-20\\31"; }, "Image Position"},
      {[](MadeSlice& slice) { slice.orientation = "-1\\0\\0\\0\\-1\\0"; }, "Image Orientation"},
      {[](MadeSlice& slice) { slice.spacing = "1\\1"; }, "Pixel Spacing"},
      {[](MadeSlice& slice) { slice.columns = 7; }, "Rows x Columns"},
      {[](MadeSlice& slice) { slice.encoding = EXS_LittleEndianImplicit; }, "Transfer Syntax UID"},
  };
  for (const auto& [change, what] : cases) {
    const Scratch folder;
    write_stack(folder.path(), 3);
    const DicomSeries series = scan_dicom(folder.path()).series.front();
    MadeSlice other;
    other.position = position_text(-10, -20, 30);
    change(other);
    write_slice(folder / "s00.dcm", other);
    EXPECT_TRUE(says(error_of([&] { load_dicom(series); }), {what, "s00.dcm", "list it again"}));
  }
}

TEST(DicomLoad, TruncatedFileAndLostFileAreNamed) {
  const Scratch folder;
  write_stack(folder.path(), 3);
  const DicomSeries series = scan_dicom(folder.path()).series.front();
  fs::resize_file(folder / "s01.dcm", fs::file_size(folder / "s01.dcm") - 10);
  EXPECT_TRUE(says(error_of([&] { load_dicom(series); }), {"truncated or damaged", "s01.dcm"}));
  fs::remove(folder / "s01.dcm");
  EXPECT_TRUE(says(error_of([&] { load_dicom(series); }), {"cannot be read", "s01.dcm"}));
}

TEST(DicomLoad, WithoutItsHashASeriesIsReadTheSame) {
  const Scratch folder;
  write_stack(folder.path(), 4);
  const DicomSeries series = scan_dicom(folder.path()).series.front();
  const DicomVolume plain = load_dicom(series, 0, {}, FileHash::left_out), hashed = load_dicom(series);
  EXPECT_EQ(plain.sha256, "");
  EXPECT_EQ(hashed.sha256, hash_files(series));
  EXPECT_EQ(plain.volume.voxels, hashed.volume.voxels);
}

TEST(DicomLoad, RefusedSeriesIsNotLoaded) {
  DicomSeries series;
  series.refusal = "slices lie crooked";
  EXPECT_EQ(error_of([&] { load_dicom(series); }), "slices lie crooked");
}

TEST(DicomLoad, StopIsHonoured) {
  const Scratch folder;
  write_stack(folder.path(), 3);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(load_dicom(scan_dicom(folder.path()).series.front(), 0, {.stop = stop.get_token()}), Cancelled);
}

/// The transfer syntaxes that DCMTK can write without loss.
class DicomLossless : public testing::TestWithParam<E_TransferSyntax> {
 protected:
  static void SetUpTestSuite() {
    DcmRLEEncoderRegistration::registerCodecs();
    DJEncoderRegistration::registerCodecs();
    DJLSEncoderRegistration::registerCodecs();
  }
};

std::vector<std::uint16_t> busy_words(int count) {
  std::vector<std::uint16_t> words;
  for (int i = 0; i < count; ++i) words.push_back(static_cast<std::uint16_t>((i * 7919) % 4096));
  return words;
}

TEST_P(DicomLossless, DecodesToTheValuesWritten) {
  MadeSlice slice;
  slice.encoding = GetParam();
  slice.bits_stored = 12;
  slice.high_bit = 11;
  slice.is_signed = false;
  slice.intercept = "0";
  slice.rows = 32;
  slice.columns = 31;
  slice.words = busy_words(32 * 31);
  const Scratch folder;
  write_slice(folder / "slice.dcm", slice);
  const DicomVolume loaded = load_folder(folder.path());
  EXPECT_EQ(loaded.volume.voxels, Hu(slice.words.begin(), slice.words.end()));
}

INSTANTIATE_TEST_SUITE_P(Syntax, DicomLossless,
                         testing::Values(EXS_LittleEndianImplicit, EXS_LittleEndianExplicit, EXS_BigEndianExplicit,
                                         EXS_DeflatedLittleEndianExplicit, EXS_RLELossless, EXS_JPEGProcess14,
                                         EXS_JPEGProcess14SV1, EXS_JPEGLSLossless));

/// Cuts the compressed frame inside an otherwise whole file.
class DicomTruncated : public DicomLossless {};

TEST_P(DicomTruncated, FrameCutShortIsRefused) {
  const Scratch folder;
  MadeSlice slice;
  slice.encoding = GetParam();
  slice.rows = slice.columns = 32;
  slice.words = busy_words(32 * 32);
  write_slice(folder / "slice.dcm", slice);
  DcmFileFormat format;
  format.loadFile((folder / "slice.dcm").c_str());
  DcmElement* element = nullptr;
  DcmPixelSequence* sequence = nullptr;
  DcmPixelItem* item = nullptr;
  Uint8* bytes = nullptr;
  format.getDataset()->findAndGetElement(DCM_PixelData, element);
  dynamic_cast<DcmPixelData&>(*element).getEncapsulatedRepresentation(GetParam(), nullptr, sequence);
  ASSERT_TRUE(sequence && sequence->getItem(item, 1).good() && item->getUint8Array(bytes).good());
  const std::vector<Uint8> shorter(bytes, bytes + item->getLength() * 3 / 8 * 2);
  item->putUint8Array(shorter.data(), shorter.size());
  format.saveFile((folder / "slice.dcm").c_str(), GetParam());
  EXPECT_TRUE(says(error_of([&] { load_folder(folder.path()); }), {"cannot be decoded", "slice.dcm", "expected"}));
}

TEST_P(DicomTruncated, FrameOfAnotherSizeIsRefused) {
  const Scratch folder;
  MadeSlice slice;
  slice.encoding = GetParam();
  slice.rows = slice.columns = 32;
  slice.words = busy_words(32 * 32);
  write_slice(folder / "slice.dcm", slice);
  DcmFileFormat format;
  format.loadFile((folder / "slice.dcm").c_str());
  format.loadAllDataIntoMemory();
  format.getDataset()->putAndInsertUint16(DCM_Rows, 40);
  format.saveFile((folder / "slice.dcm").c_str(), GetParam());
  EXPECT_TRUE(
      says(error_of([&] { load_folder(folder.path()); }), {"cannot be decoded", "slice.dcm", "expected", "found"}));
}

INSTANTIATE_TEST_SUITE_P(Syntax, DicomTruncated,
                         testing::Values(EXS_RLELossless, EXS_JPEGProcess14, EXS_JPEGProcess14SV1, EXS_JPEGLSLossless));

/// One slice of 2 rows and 4 columns whose RLE frame is `frame`.
DicomVolume load_rle(const std::vector<Uint8>& frame) {
  const Scratch folder;
  MadeSlice slice;
  slice.encoding = EXS_RLELossless;
  slice.rows = 2;
  slice.columns = 4;
  slice.intercept = "0";
  write_slice(folder / "slice.dcm", slice);
  DcmFileFormat format;
  format.loadFile((folder / "slice.dcm").c_str());
  DcmElement* element = nullptr;
  DcmPixelSequence* sequence = nullptr;
  DcmPixelItem* item = nullptr;
  format.getDataset()->findAndGetElement(DCM_PixelData, element);
  dynamic_cast<DcmPixelData&>(*element).getEncapsulatedRepresentation(EXS_RLELossless, nullptr, sequence);
  if (!sequence || sequence->getItem(item, 1).bad()) throw std::runtime_error("no RLE frame");
  item->putUint8Array(frame.data(), frame.size());
  format.saveFile((folder / "slice.dcm").c_str(), EXS_RLELossless);
  return load_folder(folder.path());
}

/// The header of a frame of two segments, the second after `first` bytes, and these.
std::vector<Uint8> rle_frame(const std::vector<Uint8>& first, const std::vector<Uint8>& second) {
  std::vector<Uint8> frame(64 + first.size() + second.size());
  frame[0] = 2;
  frame[4] = 64;
  frame[8] = static_cast<Uint8>(64 + first.size());
  std::ranges::copy(second, std::ranges::copy(first, frame.begin() + 64).out);
  return frame;
}

class DicomRle : public DicomLossless {};

TEST_F(DicomRle, RunsLiteralsNoOpsAndPadding) {
  // High bytes: a run of 8. Low bytes: nothing (128), 3 literals, a run of 5, padding.
  const DicomVolume loaded = load_rle(rle_frame({249, 1}, {128, 2, 10, 20, 30, 252, 40, 0, 0, 0}));
  EXPECT_EQ(loaded.volume.voxels, (Hu{266, 276, 286, 296, 296, 296, 296, 296}));
}

TEST_F(DicomRle, SegmentsWithMoreThanThePlaneAreRefused) {
  const std::vector<Uint8> high{249, 1}, run_beyond{2, 10, 20, 30, 130, 40},
      another_run{2, 10, 20, 30, 252, 40, 250, 7};
  EXPECT_TRUE(says(error_of([&] { load_rle(rle_frame(high, run_beyond)); }),
                   {"slice.dcm", "expected 8 bytes of RLE segment 2, found more"}));
  EXPECT_TRUE(says(error_of([&] { load_rle(rle_frame(high, another_run)); }),
                   {"expected 8 bytes of RLE segment 2, found more"}));
}

TEST_F(DicomRle, SegmentsThatLackBytesAreRefusedWithTheirCount) {
  EXPECT_TRUE(says(error_of([] {
                     load_rle(rle_frame({249, 1}, {2, 10, 20, 30, 254, 40}));
                   }),
                   {"slice.dcm", "expected 8 bytes of RLE segment 2, found 6"}));
  EXPECT_TRUE(says(error_of([] {
                     load_rle(rle_frame({5, 1, 2}, {249, 40}));
                   }),
                   {"expected 8 bytes of RLE segment 1, found 2"}));
}

}  // namespace
}  // namespace tetwarp
