// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Values that no real CT at hand has: copies of a real slice, edited, and what pydicom makes of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "deform/errors.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/image_samples.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

/// What of a slice is edited: words of 16 bits in the low Bits Stored, and attributes.
struct Edit {
  std::vector<std::uint16_t> words = {};
  int bits_allocated = 16, bits_stored = 16, high_bit = 15;
  bool is_signed = true;
  std::string slope = "1", intercept = "-1024";
  std::function<void(DcmDataset&)> more = {};
};

class EditedSlice : public testing::Test {
 protected:
  void SetUp() override {
    TETWARP_REAL_DATA(folder, "ct-transfer-syntaxes");
    ASSERT_TRUE(real_.loadFile((folder / "CTImage.dcm").c_str()).good());
    ASSERT_TRUE(real_.loadAllDataIntoMemory().good());
    const Uint16* words = nullptr;
    unsigned long count = 0;
    ASSERT_TRUE(real_.getDataset()->findAndGetUint16Array(DCM_PixelData, words, &count).good());
    real_words_.assign(words, words + count);
  }

  /// The real slice's HU, -2000 + 1024 to 2402 - 1024, as words of so many bits.
  std::vector<std::uint16_t> words(int low, int high, int offset = 0) const {
    std::vector<std::uint16_t> changed;
    for (const std::uint16_t word : real_words_) {
      const int value = std::clamp<int>(static_cast<std::int16_t>(word), low, high) + offset;
      changed.push_back(static_cast<std::uint16_t>(value));
    }
    return changed;
  }

  fs::path write(const Edit& edit, int slice = 0) {
    DcmFileFormat copy(real_);
    DcmDataset& data = *copy.getDataset();
    const auto word = [&](const DcmTagKey& tag, int value) {
      data.putAndInsertUint16(tag, static_cast<Uint16>(value));
    };
    word(DCM_BitsAllocated, edit.bits_allocated);
    word(DCM_BitsStored, edit.bits_stored);
    word(DCM_HighBit, edit.high_bit);
    word(DCM_PixelRepresentation, edit.is_signed ? 1 : 0);
    data.putAndInsertString(DCM_RescaleSlope, edit.slope.c_str());
    data.putAndInsertString(DCM_RescaleIntercept, edit.intercept.c_str());
    data.putAndInsertString(DCM_SOPInstanceUID, ("1.2.3." + std::to_string(slice + 1)).c_str());
    data.putAndInsertString(DCM_ImagePositionPatient, position_text(-161.4, -148.8, 4.7 + 6.5 * slice).c_str());
    for (const auto& tag : {DCM_SmallestImagePixelValue, DCM_LargestImagePixelValue, DCM_PixelPaddingValue})
      delete data.remove(tag);
    if (edit.bits_allocated == 8) {
      const std::vector<Uint8> bytes(edit.words.begin(), edit.words.end());
      data.putAndInsertUint8Array(DCM_PixelData, bytes.data(), bytes.size());
    } else {
      data.putAndInsertUint16Array(DCM_PixelData, edit.words.data(), edit.words.size());
    }
    if (edit.more) edit.more(data);
    const fs::path file = folder_ / ("s" + std::to_string(slice) + ".dcm");
    if (copy.saveFile(file.c_str(), EXS_LittleEndianExplicit).bad()) throw std::runtime_error("cannot write the copy");
    return file;
  }

  /// Whether the HU of one slice of a volume are what pydicom and numpy compute, rounded half to even.
  void expect_as_pydicom(const fs::path& file, std::span<const std::int16_t> hu) {
    const fs::path out = folder_ / "hu";
    const std::string command = TETWARP_PYTHON " " TETWARP_HU_OF " '" + file.string() + "' '" + out.string() + "'";
    const int status = std::system(command.c_str());
    if (WIFEXITED(status) && WEXITSTATUS(status) == 77) GTEST_SKIP() << "pydicom is not installed";
    ASSERT_EQ(status, 0) << command;
    const std::string bytes = read_bytes(out);
    std::vector<double> expected(bytes.size() / sizeof(double));
    std::memcpy(expected.data(), bytes.data(), bytes.size());
    ASSERT_EQ(expected.size(), hu.size());
    for (std::size_t n = 0; n < hu.size(); ++n) ASSERT_EQ(hu[n], std::nearbyint(expected[n])) << "pixel " << n;
  }

  /// One slice that must read. @return its series, with the warnings
  DicomSeries expect_reads_as_pydicom(const Edit& edit) {
    const fs::path file = write(edit);
    const DicomScan scan = scan_dicom(file, true);
    const DicomVolume loaded = load_dicom(scan.series.at(0), 1);
    expect_as_pydicom(file, loaded.volume.voxels);
    return scan.series[0];
  }

  DcmFileFormat real_;
  std::vector<std::uint16_t> real_words_;
  const Scratch folder_;
};

TEST_F(EditedSlice, MonochromeOneChangesTheDisplayNotTheHu) {
  Edit edit{.words = real_words_};
  edit.more = [](DcmDataset& data) { data.putAndInsertString(DCM_PhotometricInterpretation, "MONOCHROME1"); };
  const DicomSeries series = expect_reads_as_pydicom(edit);
  EXPECT_TRUE(std::any_of(series.warnings.begin(), series.warnings.end(),
                          [](const std::string& warning) { return warning.starts_with("MONOCHROME1"); }));
}

/// PS3.3 C.7.6.3.1.2: which end is white is said after the Modality and VOI LUTs, so HU and window stay.
TEST_F(EditedSlice, DerivedFromMonochromeOneIsMonochromeTwoOfTheSameHuAndWindow) {
  Edit edit{.words = real_words_};
  edit.more = [](DcmDataset& data) {
    data.putAndInsertString(DCM_PhotometricInterpretation, "MONOCHROME1");
    data.putAndInsertString(DCM_PresentationLUTShape, "INVERSE");
    data.putAndInsertString(DCM_WindowCenter, "40");
    data.putAndInsertString(DCM_WindowWidth, "400");
  };
  for (const int k : {0, 1}) write(edit, k);
  const DicomVolume source = load_dicom(scan_dicom(folder_.path()).series.at(0));
  const Scratch derived;
  DicomDerivation derivation;
  derivation.field_sha256 = std::string(64, '0');
  write_derived_series(derived.path(), view(source.volume), *source.headers, derivation);
  const DicomScan scan = scan_dicom(derived.path());
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_EQ(load_dicom(scan.series[0]).volume.voxels, source.volume.voxels);
  EXPECT_TRUE(scan.series[0].warnings.empty());
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(scan.series[0].slices.at(1).file.c_str()).good());
  const auto text = [&](const DcmTagKey& tag) { return text_of(*file.getDataset(), tag); };
  EXPECT_EQ(text(DCM_PhotometricInterpretation), "MONOCHROME2");
  EXPECT_FALSE(file.getDataset()->tagExists(DCM_PresentationLUTShape));
  EXPECT_EQ(text(DCM_WindowCenter) + " " + text(DCM_WindowWidth), "40 400");
}

TEST_F(EditedSlice, SlopeAndInterceptAreThoseOfEachSlice) {
  const std::vector<std::pair<std::string, std::string>> rescale = {
      {"1", "-1024"}, {"2", "-500"}, {"0.5", "0"}, {"1.5", "-100.25"}, {"-1", "7"}};
  std::vector<fs::path> files;
  for (int k = 0; k < std::ssize(rescale); ++k)
    files.push_back(write({.words = real_words_, .slope = rescale[k].first, .intercept = rescale[k].second}, k));
  const DicomVolume loaded = load_dicom(scan_dicom(folder_.path()).series.at(0));
  const std::size_t size = real_words_.size();
  ASSERT_EQ(loaded.volume.voxels.size(), files.size() * size);
  for (std::size_t k = 0; k < files.size(); ++k)
    expect_as_pydicom(files[k], std::span(loaded.volume.voxels).subspan(k * size, size));
}

TEST_F(EditedSlice, UnsignedWordsWithANegativeIntercept) {
  expect_reads_as_pydicom({.words = words(-2000, 4095, 2000), .is_signed = false, .intercept = "-3024"});
  expect_reads_as_pydicom({.words = words(-2000, 2095, 32768), .is_signed = false, .intercept = "-33792"});
}

TEST_F(EditedSlice, BitsAboveTheStoredOnesAreNoPartOfTheValue) {
  Edit edit{.words = words(-1024, 3071, 1024), .bits_stored = 12, .high_bit = 11, .is_signed = false};
  for (std::size_t n = 0; n < edit.words.size(); ++n) edit.words[n] |= static_cast<std::uint16_t>(n % 16 << 12);
  expect_reads_as_pydicom(edit);
}

TEST_F(EditedSlice, SignOfFewerBitsIsExtended) {
  for (const int bits : {10, 12, 15}) {
    const int half = 1 << (bits - 1);
    Edit edit{.words = words(-half, half - 1), .bits_stored = bits, .high_bit = bits - 1};
    for (std::uint16_t& word : edit.words) word &= static_cast<std::uint16_t>(2 * half - 1);
    expect_reads_as_pydicom(edit);
  }
}

TEST_F(EditedSlice, StoredBitsMayLieHigherInTheWord) {
  for (const bool is_signed : {false, true}) {
    Edit edit{
        .words = words(-1024, 1023, is_signed ? 0 : 1024), .bits_stored = 12, .high_bit = 15, .is_signed = is_signed};
    for (std::size_t n = 0; n < edit.words.size(); ++n)
      edit.words[n] = static_cast<std::uint16_t>(edit.words[n] << 4 | n % 16);
    expect_reads_as_pydicom(edit);
  }
}

TEST_F(EditedSlice, EightBitsAreReadAsBytesOrInWords) {
  Edit edit{
      .bits_allocated = 8, .bits_stored = 8, .high_bit = 7, .is_signed = false, .slope = "16", .intercept = "-2048"};
  for (const std::uint16_t word : words(-1024, 3071, 1024)) edit.words.push_back(word / 16);
  expect_reads_as_pydicom(edit);
  edit.more = [&](DcmDataset& data) {
    std::vector<Uint16> pairs;
    for (std::size_t n = 0; n < edit.words.size(); n += 2)
      pairs.push_back(static_cast<Uint16>(edit.words[n] | edit.words[n + 1] << 8));
    auto* element = new DcmPixelData(DcmTag(DCM_PixelData, EVR_OW));
    element->putUint16Array(pairs.data(), pairs.size());
    data.insert(element, true);
  };
  expect_reads_as_pydicom(edit);
}

TEST_F(EditedSlice, ThirtyTwoBitsAreRefusedByName) {
  Edit edit{.words = real_words_, .bits_allocated = 32, .bits_stored = 32, .high_bit = 31};
  edit.words.insert(edit.words.end(), real_words_.begin(), real_words_.end());
  const DicomScan scan = scan_dicom(write(edit), true);
  EXPECT_TRUE(says(scan.series.at(0).refusal.value_or(""), {"Bits Allocated (0028,0100)", "found 32"}));
}

/// An attribute of two bytes, or of a number of four, with whatever VR.
void put_word(DcmDataset& data, const DcmTagKey& tag, DcmEVR vr, int value) {
  const auto word = static_cast<Uint16>(value);
  DcmElement* element = nullptr;
  switch (vr) {
    case EVR_US: element = new DcmUnsignedShort(DcmTag(tag, vr)); break;
    case EVR_SS: element = new DcmSignedShort(DcmTag(tag, vr)); break;
    case EVR_SL: element = new DcmSignedLong(DcmTag(tag, vr)); break;
    case EVR_UL: element = new DcmUnsignedLong(DcmTag(tag, vr)); break;
    case EVR_IS: element = new DcmIntegerString(DcmTag(tag, vr)); break;
    default: element = new DcmOtherByteOtherWord(DcmTag(tag, vr)); break;
  }
  if (vr == EVR_SS) {
    const auto number = static_cast<Sint16>(word);
    element->putSint16Array(&number, 1);
  } else if (vr == EVR_SL || vr == EVR_UL || vr == EVR_IS) {
    element->putString(std::to_string(vr == EVR_UL ? word : value).c_str());
  } else if (vr == EVR_UN || vr == EVR_OB) {
    const Uint8 bytes[] = {static_cast<Uint8>(word & 255), static_cast<Uint8>(word >> 8)};
    element->putUint8Array(bytes, 2);
  } else {
    element->putUint16Array(&word, 1);
  }
  data.insert(element, true);
}

TEST_F(EditedSlice, PaddingIsReadWhateverItsVr) {
  struct Case {
    bool is_signed;
    int value, limit;  // the 16 bits of each
    double low, high;  // HU
  };
  // The real slice's own padding, -2000, and ranges in either order; 63536 is -2000 of unsigned 16 bits.
  for (const Case& c : {Case{true, -2000, -2000, -3024, -3024},
                        {true, -2000, -1500, -3024, -2524},
                        {true, -1500, -2000, -3024, -2524},
                        {false, 10, 30, -1014, -994},
                        {false, 63000, 63536, 61976, 62512}}) {
    for (const DcmEVR vr : {EVR_US, EVR_SS, EVR_UN, EVR_OW, EVR_OB, EVR_SL, EVR_UL, EVR_IS}) {
      SCOPED_TRACE(std::string(DcmVR(vr).getVRName()) + " " + std::to_string(c.value));
      Edit edit{.words = c.is_signed ? real_words_ : words(0, 2000), .is_signed = c.is_signed};
      edit.more = [&](DcmDataset& data) {
        put_word(data, DCM_PixelPaddingValue, vr, c.value);
        if (c.limit != c.value) put_word(data, DCM_PixelPaddingRangeLimit, vr, c.limit);
      };
      const fs::path file = write(edit);
      const DicomVolume loaded = load_dicom(scan_dicom(file, true).series.at(0), 1);
      ASSERT_TRUE(loaded.padding);
      EXPECT_EQ(loaded.padding->low, std::min(c.low, 32767.0));
      EXPECT_EQ(loaded.padding->high, std::min(c.high, 32767.0));
    }
  }
}

}  // namespace
}  // namespace tetwarp
