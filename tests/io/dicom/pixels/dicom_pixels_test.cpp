// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/pixels/dicom_pixels.h"

#include <gtest/gtest.h>

#include <numeric>

#include "deform/errors.h"

namespace tetwarp {
namespace {

PixelFormat format(int bits_stored, int high_bit, bool is_signed, double intercept, int bits_allocated = 16) {
  PixelFormat format;
  format.bits_allocated = bits_allocated;
  format.bits_stored = bits_stored;
  format.high_bit = high_bit;
  format.is_signed = is_signed;
  format.slope = 1;
  format.intercept = intercept;
  return format;
}

/// The stored value of a word (PS3.5 8.1.1), plus the intercept.
int expected_hu(const PixelFormat& format, int word) {
  const int range = 1 << format.bits_stored;
  int value = (word >> (format.high_bit + 1 - format.bits_stored)) % range;
  if (format.is_signed && value >= range / 2) value -= range;
  return value + static_cast<int>(*format.intercept);
}

TEST(Hu, IsTheStoredValueAndTheInterceptForEveryWord) {
  for (const auto& [bits_stored, high_bit] : {std::pair{16, 15}, {12, 11}, {15, 14}, {1, 0}, {12, 15}, {8, 9}}) {
    for (const bool is_signed : {false, true}) {
      for (const double intercept : {0, 1, -1, -1000, -1024, -8192, 3000, -32768, -32769, 32767, 32768, -65536}) {
        SCOPED_TRACE(std::to_string(bits_stored) + " bits to " + std::to_string(high_bit) +
                     (is_signed ? ", signed, " : ", unsigned, ") + std::to_string(intercept));
        const PixelFormat stored = format(bits_stored, high_bit, is_signed, intercept);
        const auto table = make_hu_table(stored);
        std::vector<std::uint16_t> fitting;
        for (int word = 0; word <= UINT16_MAX; ++word) {
          const int hu = expected_hu(stored, word);
          const bool fits = hu >= INT16_MIN && hu <= INT16_MAX;
          if (fits) fitting.push_back(static_cast<std::uint16_t>(word));
          // The nearest that do not fit, one by one: all would be too many exceptions.
          if (fits || (hu != INT16_MIN - 1 && hu != INT16_MAX + 1)) continue;
          const auto alone = static_cast<std::uint16_t>(word);
          std::int16_t out = 0;
          EXPECT_THROW(convert_to_hu(std::span(&alone, 1), *table, "slice", std::span(&out, 1)), InputError) << word;
        }
        std::vector<std::int16_t> found(fitting.size());
        const HuCount count = convert_to_hu(fitting, *table, "slice", found);
        EXPECT_EQ(count.rounded, 0U);
        for (std::size_t n = 0; n < found.size(); ++n) {
          ASSERT_EQ(found[n], expected_hu(stored, fitting[n])) << "word " << fitting[n];
        }
      }
    }
  }
}

TEST(Hu, OfEightBitsIsKnownForEveryWordThatADecoderMayGive) {
  for (const auto& [bits_stored, high_bit] : {std::pair{8, 7}, {7, 6}, {1, 0}, {4, 7}, {5, 5}}) {
    for (const bool is_signed : {false, true}) {
      for (const double slope : {1.0, 2.0}) {  // 1 is converted by an offset, 2 by the table
        PixelFormat stored = format(bits_stored, high_bit, is_signed, 3, 8);
        stored.slope = slope;
        std::vector<std::uint16_t> words(UINT16_MAX + 1);
        std::iota(words.begin(), words.end(), std::uint16_t{0});
        std::vector<std::int16_t> found(words.size());
        convert_to_hu(words, *make_hu_table(stored), "slice", found);
        for (std::size_t n = 0; n < found.size(); ++n) {
          ASSERT_EQ(found[n], slope * (expected_hu(stored, words[n]) - 3) + 3)
              << bits_stored << " bits to " << high_bit << ", word " << words[n];
        }
      }
    }
  }
}

TEST(Hu, OfAnotherNumberOfPixelsThanVoxelsIsRefused) {
  const auto table = make_hu_table(format(12, 11, false, -1024));
  const std::vector<std::uint16_t> words(5);
  std::vector<std::int16_t> hu(6);
  EXPECT_THROW(convert_to_hu(words, *table, "slice", hu), InputError);
  EXPECT_THROW(convert_to_hu(words, *table, "slice", std::span(hu).first(4)), InputError);
}

TEST(Hu, WordsMayLieAtAnyAddress) {
  const auto table = make_hu_table(format(12, 11, false, -1024));
  const unsigned char file[] = {0xff, 0x00, 0x04, 0xff, 0xff, 0x01, 0x10};
  std::int16_t hu[3] = {};
  convert_to_hu(std::as_bytes(std::span(file)).subspan(1), *table, "slice", hu);
  EXPECT_EQ(hu[0], 0);
  EXPECT_EQ(hu[1], 4095 - 1024);  // bits above the stored ones are none of it
  EXPECT_EQ(hu[2], 1 - 1024);
}

}  // namespace
}  // namespace tetwarp
