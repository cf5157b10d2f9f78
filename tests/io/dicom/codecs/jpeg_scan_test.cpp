// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Lossless JPEG decoded here, against what was encoded; and damage that shows to the bit.
#include "io/dicom/codecs/jpeg_scan.h"

#include <gtest/gtest.h>

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmjpeg/djrplol.h>

#include <algorithm>

#include "tests/support/dicom/coded_slices.h"
#include "tests/support/dicom/jpeg_writer.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

using Words = std::vector<std::uint16_t>;

std::span<const std::uint8_t> octets(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// What decoding gives, or why there is nothing.
struct Decoded {
  Words words;
  std::string problem;
};

Decoded decode(const std::string& stream, bool is_signed = false) {
  Decoded decoded;
  const JpegScan scan = read_jpeg_scan(octets(stream), decoded.problem);
  decoded.words.resize(static_cast<std::size_t>(scan.frame.rows * scan.frame.columns));
  if (decoded.problem.empty()) decoded.problem = decode_lossless(scan, is_signed, decoded.words);
  return decoded;
}

/// 3 rows of 4 samples, each 10 more than the one before; rows begin anew after a restart.
std::string ramp(int restart_rows, int end_fill = 1, int first_restart = 0) {
  JpegWriter writer(0xc3, 3, 4, 12, restart_rows * 4);
  writer.scan(1);
  for (int j = 0; j < 3; ++j) {
    const bool is_first = j == 0 || (restart_rows > 0 && j % restart_rows == 0);
    if (is_first && j > 0) writer.marker(0xd0 + (first_restart + j / restart_rows - 1) % 8);
    for (int i = 0; i < 4; ++i) writer.difference(i > 0 ? 10 : is_first ? 100 - 2048 : 0);
  }
  writer.marker(0xd9, end_fill);
  return writer.bytes();
}

const Words kRamp = {100, 110, 120, 130, 100, 110, 120, 130, 100, 110, 120, 130};

TEST(JpegLossless, RestartsBeginAnewFromTheMiddleValue) {
  for (const int restart_rows : {0, 1, 2, 3, 7}) {
    const Decoded decoded = decode(ramp(restart_rows));
    EXPECT_EQ(decoded.problem, "") << restart_rows;
    EXPECT_EQ(decoded.words, kRamp) << restart_rows;
  }
}

TEST(JpegLossless, RestartsOutOfOrderOrWithinARowAreRefused) {
  EXPECT_TRUE(says(decode(ramp(1, 1, 1)).problem, {"damaged", "in row 2"}));
  JpegWriter within(0xc3, 3, 4, 12, 6);
  within.scan(1);
  EXPECT_TRUE(says(decode(within.bytes()).problem, {"whole rows", "6 samples"}));
}

TEST(JpegLossless, LastByteIsFilledWithOnes) {
  EXPECT_EQ(decode(ramp(0, 1)).problem, "");
  EXPECT_TRUE(says(decode(ramp(0, 0)).problem, {"damaged", "left over"}));
}

TEST(JpegLossless, SamplesBeyondThePrecisionAreRefusedUnlessTheyAreSigns) {
  const auto stream = [](int first) {
    JpegWriter writer(0xc3, 1, 1, 12);
    writer.scan(1);
    writer.difference(first - 2048);
    writer.marker(0xd9);
    return writer.bytes();
  };
  EXPECT_EQ(decode(stream(4095)).words, Words{4095});
  EXPECT_EQ(decode(stream(0)).words, Words{0});
  EXPECT_TRUE(says(decode(stream(4096)).problem, {"damaged", "in row 1"}));
  EXPECT_TRUE(says(decode(stream(-5)).problem, {"damaged"}));
  EXPECT_EQ(decode(stream(-5), true).words, Words{0xfffb});
  EXPECT_EQ(decode(stream(-2048), true).words, Words{0xf800});
  EXPECT_TRUE(says(decode(stream(-2049), true).problem, {"damaged"}));
}

TEST(JpegLossless, DifferenceOf32768HasNoFurtherBits) {
  JpegWriter writer(0xc3, 1, 3, 16);
  writer.scan(1);
  writer.difference(-32768 + 5);
  writer.bits(16, 5);
  writer.difference(1);
  writer.marker(0xd9);
  const Decoded decoded = decode(writer.bytes());
  EXPECT_EQ(decoded.problem, "");
  EXPECT_EQ(decoded.words, (Words{5, 32773, 32774}));
}

TEST(JpegLossless, EveryPredictorAndShiftGivesBackWhatDcmtkEncoded) {
  register_encoders();
  const Scratch folder;
  for (int predictor = 1; predictor <= 7; ++predictor) {
    for (const int shift : {0, 3}) {
      for (const int bits : {8, 12, 16}) {
        MadeSlice slice = busy_slice();
        slice.rows = 20;
        slice.columns = 31;
        slice.words = busy_words(620);
        slice.bits_allocated = bits == 8 ? 8 : 16;
        slice.bits_stored = bits;
        slice.high_bit = bits - 1;
        for (std::uint16_t& word : slice.words) word = static_cast<std::uint16_t>(word * 16 >> (16 - bits));
        const DJ_RPLossless parameter(predictor, shift);
        slice.encoder_parameter = &parameter;
        const Decoded decoded = decode(encoded_frame(folder.path(), slice, EXS_JPEGProcess14));
        EXPECT_EQ(decoded.problem, "");
        for (std::uint16_t& word : slice.words) word = static_cast<std::uint16_t>(word >> shift << shift);
        EXPECT_EQ(decoded.words, slice.words) << "predictor " << predictor << ", " << shift << ", " << bits << " bits";
      }
    }
  }
}

/// One row of blocks, of which each has `coefficients` after its first.
std::string blocks(int count, int coefficients, int restart_interval, bool with_end = true) {
  JpegWriter writer(0xc1, 8, 8 * count, 8, restart_interval);
  writer.scan(0);
  for (int n = 0; n < count; ++n) {
    if (restart_interval > 0 && n > 0 && n % restart_interval == 0)
      writer.marker(0xd0 + (n / restart_interval - 1) % 8);
    writer.difference(3);
    for (int k = 0; k < coefficients; ++k) writer.difference(1);  // a run of 0 and a size of 1
    if (coefficients < 63) writer.bits(0, 5);                     // the end of the block
  }
  if (with_end) writer.marker(0xd9);
  return writer.bytes();
}

std::string problem_of(const std::string& stream) {
  std::string problem;
  const JpegScan scan = read_jpeg_scan(octets(stream), problem);
  return problem.empty() ? sequential_problem(scan) : problem;
}

TEST(JpegSequential, BlocksAreFollowedToTheBit) {
  for (const int coefficients : {0, 1, 62, 63}) {
    for (const int restart_interval : {0, 1, 3}) {
      EXPECT_EQ(problem_of(blocks(20, coefficients, restart_interval)), "");
    }
  }
  EXPECT_TRUE(says(problem_of(blocks(20, 64, 0)), {"damaged"}));
  EXPECT_TRUE(says(problem_of(blocks(20, 2, 0, false)), {"damaged"}));
  std::string fewer = blocks(20, 2, 0), more = fewer;
  const std::size_t columns_at = fewer.find("\xff\xc1") + 7;
  fewer[columns_at + 1] = static_cast<char>(8 * 19);
  EXPECT_TRUE(says(problem_of(fewer), {"damaged", "left over"}));
  more[columns_at + 1] = static_cast<char>(8 * 21);
  EXPECT_TRUE(says(problem_of(more), {"damaged", "in block 21"}));
}

TEST(JpegHeader, DamagedOrMissingPartsAreNamed) {
  const std::string whole = ramp(0);
  EXPECT_EQ(problem_of(""), "expected a scan of one component, found none");
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_NE(decode(whole.substr(0, size)).problem, "") << size;
  std::string crowded = whole;  // more codes of one bit than there are
  crowded[crowded.find("\xff\xc4") + 5] = 3;
  EXPECT_TRUE(says(decode(crowded).problem, {"Huffman", "damaged"}));
  std::string other = whole;
  other[other.find("\xff\xda") + 7] = 9;
  EXPECT_TRUE(says(decode(other).problem, {"predictor 1 to 7", "found 9"}));
  std::string elsewhere = whole;
  elsewhere[elsewhere.find("\xff\xda") + 6] = 0x30;
  EXPECT_TRUE(says(decode(elsewhere).problem, {"Huffman", "found none"}));
  const std::size_t scan = whole.find("\xff\xda"), frame = whole.find("\xff\xc3");
  const std::string early = whole.substr(0, frame) + whole.substr(scan, 10) + whole.substr(frame);
  EXPECT_EQ(problem_of(early), "expected a frame header before the scan, found none");
}

}  // namespace
}  // namespace tetwarp
