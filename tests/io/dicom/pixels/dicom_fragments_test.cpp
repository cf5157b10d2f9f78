// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Compressed frames in all the ways in which their bytes may lie in a file.
#include <gtest/gtest.h>

#include "io/dicom_series.h"
#include "tests/support/dicom/coded_slices.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

using Hu = std::vector<std::int16_t>;

class DicomFragments : public testing::TestWithParam<Coding> {
 protected:
  static void SetUpTestSuite() { register_encoders(); }

  Hu load(const std::vector<std::string>& fragments, const std::vector<std::uint32_t>& offsets = {}) {
    write_encapsulated(file_, GetParam().slice(), GetParam().uid, fragments, offsets);
    const DicomScan scan = scan_dicom(file_, true);
    if (scan.series.size() != 1)
      throw std::runtime_error(scan.skipped.empty() ? "no series" : to_string(scan.skipped.front()));
    return load_dicom(scan.series.front(), 1).volume.voxels;
  }

  const Scratch folder_;
  const std::filesystem::path file_ = folder_ / "slice.dcm";
};

std::vector<std::string> split(const std::string& bytes, std::size_t size) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at < bytes.size(); at += size) parts.push_back(bytes.substr(at, size));
  return parts;
}

TEST_P(DicomFragments, AnyNumberOfThemIsOneFrame) {
  const std::string frame = GetParam().frame(folder_.path());
  const Hu whole = load({frame});
  if (GetParam().is_lossless) {
    const std::vector<std::uint16_t> words = GetParam().slice().words;
    EXPECT_EQ(whole, Hu(words.begin(), words.end()));
  }
  for (const std::size_t size : {frame.size() / 2 / 2 * 2, std::size_t{10}, std::size_t{2}})
    EXPECT_EQ(load(split(frame, size)), whole) << "fragments of " << size << " bytes";
  EXPECT_EQ(load({"", frame.substr(0, 20), "", frame.substr(20), ""}), whole) << "fragments without a byte";
}

TEST_P(DicomFragments, OddLengthsAreReadAsTheyAre) {
  const std::string frame = GetParam().frame(folder_.path());
  const Hu whole = load({frame});
  for (const std::size_t size : {std::size_t{7}, std::size_t{1}, frame.size() / 2 | 1})
    EXPECT_EQ(load(split(frame, size)), whole) << "fragments of " << size << " bytes";
}

TEST_P(DicomFragments, OffsetTableDecidesNothingWhereThereIsOneFrame) {
  const std::string frame = GetParam().frame(folder_.path());
  const Hu whole = load({frame});
  const std::vector<std::string> parts = split(frame, 10);
  for (const std::vector<std::uint32_t>& offsets :
       {std::vector<std::uint32_t>{0}, {12345678}, {0, 18}, {0, 18, 36, 54}, {0xffffffff, 0xffffffff}})
    EXPECT_EQ(load(parts, offsets), whole) << offsets.size() << " offsets, the last " << offsets.back();
}

TEST_P(DicomFragments, PaddingBehindTheFrameIsNoPartOfIt) {
  const std::string frame = GetParam().frame(folder_.path());
  const Hu whole = load({frame});
  for (const std::size_t size : {1, 2, 63, 1000}) {
    EXPECT_EQ(load({frame + std::string(size, '\0')}), whole) << size << " zeros";
    EXPECT_EQ(load({frame, std::string(size, '\0')}), whole) << size << " zeros in a fragment of their own";
  }
}

TEST_P(DicomFragments, FrameThatLacksItsEndIsRefused) {
  const std::string frame = GetParam().frame(folder_.path());
  for (std::size_t size = 0; size + 3 < frame.size(); size += 1 + size / 7) {
    try {
      load({frame.substr(0, size)});
      ADD_FAILURE() << size << " of " << frame.size() << " bytes are read";
    } catch (const InputError& error) {
      EXPECT_TRUE(says(error.what(), {"cannot be decoded", "slice.dcm"}));
    }
  }
}

TEST_P(DicomFragments, FrameOfAnotherSizeIsRefused) {
  const std::string frame = GetParam().frame(folder_.path());
  for (const auto& [rows, columns] : {std::pair{9, 12}, {11, 12}, {12, 11}, {10, 13}, {10, 11}, {400, 400}}) {
    MadeSlice slice = GetParam().slice();
    slice.rows = rows;
    slice.columns = columns;
    write_encapsulated(file_, slice, GetParam().uid, {frame});
    try {
      load_dicom(scan_dicom(file_, true).series.at(0), 1);
      ADD_FAILURE() << rows << " x " << columns << " is read";
    } catch (const InputError& error) {
      EXPECT_TRUE(says(error.what(), {"cannot be decoded", "slice.dcm", "expected", "found"}));
    }
  }
}

TEST_P(DicomFragments, PixelDataThatAreNotCompressedAreRefused) {
  const MadeSlice slice = GetParam().slice();
  std::string bytes = file_start(GetParam().uid) + attributes_of(slice);
  append_element(bytes, 0x7fe0, 0x10, "OW", 240);
  write_file(file_, bytes + std::string(240, '\1'));
  const DicomScan scan = scan_dicom(file_, true);
  EXPECT_THROW(load_dicom(scan.series.at(0), 1), InputError);
}

TEST_P(DicomFragments, CompressedFrameOfASyntaxWithoutCompressionIsRefused) {
  const std::string frame = GetParam().frame(folder_.path());
  for (const char* uid : {UID_LittleEndianExplicitTransferSyntax, UID_LittleEndianImplicitTransferSyntax}) {
    write_encapsulated(file_, GetParam().slice(), uid, {frame});
    const DicomScan scan = scan_dicom(file_, true);
    if (scan.series.empty()) continue;
    EXPECT_THROW(load_dicom(scan.series.front(), 1), InputError) << uid;
  }
}

INSTANTIATE_TEST_SUITE_P(Syntax, DicomFragments, testing::ValuesIn(codings()),
                         [](const auto& coding) { return coding.param.name; });

}  // namespace
}  // namespace tetwarp
