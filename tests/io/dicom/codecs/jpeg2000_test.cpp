// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// JPEG 2000 through OpenJPEG, whose encoder makes the streams.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "deform/errors.h"
#include "io/dicom/codecs/dicom_codecs.h"
#include "tests/support/dicom/coded_slices.h"
#include "tests/support/says.h"

namespace tetwarp {
namespace {

DicomFileHeader header_of(int rows, int columns, int bits_stored, bool is_signed) {
  DicomFileHeader header;
  header.file = "slice.dcm";
  header.pixels.rows = rows;
  header.pixels.columns = columns;
  header.pixels.bits_allocated = 16;
  header.pixels.bits_stored = bits_stored;
  header.pixels.high_bit = bits_stored - 1;
  header.pixels.is_signed = is_signed;
  return header;
}

std::vector<int> decode(const std::string& stream, const DicomFileHeader& header) {
  const auto words = decode_jpeg_2000({reinterpret_cast<const std::uint8_t*>(stream.data()), stream.size()}, header);
  std::vector<int> samples;
  for (const std::uint16_t word : words) samples.push_back(stored_value(header.pixels, word));
  return samples;
}

std::string refusal(const std::string& stream, const DicomFileHeader& header) {
  try {
    decode(stream, header);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

/// A ball in noise, of 12 bits.
MadeCodestream ball(int rows, int columns, int low = 0) {
  MadeCodestream made{rows, columns, 12, low < 0, {}, {}};
  std::minstd_rand random;
  for (int n = 0; n < rows * columns; ++n) {
    const double distance = std::hypot(n % columns - columns / 2, n / columns - rows / 2);
    made.samples.push_back(low + (distance < rows / 3 ? 2000 : 100) + static_cast<int>(random() % 100));
  }
  return made;
}

const DicomFileHeader kHeader = header_of(96, 100, 12, false);

using Change = std::function<void(opj_cparameters_t&)>;

TEST(Jpeg2000, EveryStyleOfCodingGivesBackTheSamples) {
  MadeCodestream made = ball(96, 100);
  std::vector<Change> changes;
  for (int mode = 0; mode < 64; ++mode) changes.push_back([=](auto& p) { p.mode = mode; });
  for (const int levels : {1, 2, 7}) changes.push_back([=](auto& p) { p.numresolution = levels; });
  for (const auto& [width, height] : {std::pair{4, 4}, {1024, 4}, {4, 256}, {32, 32}})
    changes.push_back([w = width, h = height](auto& p) { p.cblockw_init = w, p.cblockh_init = h; });
  for (const auto order : {OPJ_LRCP, OPJ_RLCP, OPJ_RPCL, OPJ_PCRL, OPJ_CPRL})
    changes.push_back([=](auto& p) { p.prog_order = order, p.csty = 6; });
  changes.push_back([](auto& p) { p.tile_size_on = 1, p.cp_tdx = 34, p.cp_tdy = 40; });
  changes.push_back([](auto& p) { p.tp_on = 1, p.tp_flag = 'R'; });
  changes.push_back([](auto& p) {
    p.tcp_numlayers = 3;
    p.tcp_rates[0] = 20, p.tcp_rates[1] = 5, p.tcp_rates[2] = 1;
  });
  changes.push_back([](auto& p) {
    p.csty = 1, p.res_spec = 2, p.prcw_init[0] = p.prch_init[0] = 32, p.prcw_init[1] = p.prch_init[1] = 16;
  });
  for (std::size_t n = 0; n < changes.size(); ++n) {
    made.change = changes[n];
    EXPECT_EQ(decode(made.encode(), kHeader), made.samples) << "change " << n;
  }
}

TEST(Jpeg2000, WhatWasCutOffOnPurposeIsNotTakenForDamage) {
  MadeCodestream made = ball(96, 100);
  for (const float rate : {2.0f, 3.0f, 5.0f, 8.0f, 15.0f, 40.0f}) {
    for (const bool irreversible : {false, true}) {
      for (const int layers : {1, 2}) {
        made.change = [&](auto& p) {
          p.irreversible = irreversible;
          p.tcp_numlayers = layers;
          for (int n = 0; n < layers; ++n) p.tcp_rates[n] = rate * static_cast<float>(layers - n);
        };
        const std::vector<int> found = decode(made.encode(), kHeader);
        double sum = 0;
        for (std::size_t n = 0; n < found.size(); ++n) sum += std::abs(found[n] - made.samples[n]);
        EXPECT_LT(sum / static_cast<double>(found.size()), 5 * rate) << rate;
      }
    }
  }
}

TEST(Jpeg2000, SignAndPrecisionAreThoseOfTheCodestream) {
  const auto decoded = [](int precision, bool is_signed, const std::vector<int>& samples,
                          const DicomFileHeader& header) {
    return decode(MadeCodestream{1, 4, precision, is_signed, samples, [](auto& p) { p.numresolution = 1; }}.encode(),
                  header);
  };
  using Samples = std::vector<int>;
  EXPECT_EQ(decoded(16, true, {-32768, -1, 0, 32767}, header_of(1, 4, 16, true)), (Samples{-32768, -1, 0, 32767}));
  EXPECT_EQ(decoded(16, false, {0, 1, 65535, 32768}, header_of(1, 4, 16, false)), (Samples{0, 1, 65535, 32768}));
  EXPECT_EQ(decoded(12, true, {-2048, -1, 0, 2047}, header_of(1, 4, 12, true)), (Samples{-2048, -1, 0, 2047}));
  // Fewer bits than Bits Stored, and more.
  EXPECT_EQ(decoded(12, true, {-2048, -1, 0, 2047}, header_of(1, 4, 16, true)), (Samples{-2048, -1, 0, 2047}));
  EXPECT_EQ(decoded(16, true, {-2048, -1, 0, 2047}, header_of(1, 4, 12, true)), (Samples{-2048, -1, 0, 2047}));
  // Some encoders take two's complement for numbers without a sign, others numbers without a sign for two's complement.
  EXPECT_EQ(decoded(13, false, {0, 1, 4096, 8191}, header_of(1, 4, 13, true)), (Samples{0, 1, -4096, -1}));
  EXPECT_EQ(decoded(12, true, {-2048, -1, 0, 2047}, header_of(1, 4, 12, false)), (Samples{2048, 4095, 0, 2047}));
}

TEST(Jpeg2000, HeaderThatContradictsTheAttributesIsRefused) {
  const std::string stream = ball(96, 100).encode();
  EXPECT_TRUE(says(refusal(stream, header_of(100, 96, 12, false)),
                   {"slice.dcm", "expected an image of 100 x 96, found one of 96 x 100"}));
  EXPECT_TRUE(says(refusal(stream, header_of(96, 100, 16, true)),
                   {"expected signed samples, found unsigned ones of 12 bits for 16 Bits Stored"}));
  DicomFileHeader bytes = header_of(96, 100, 8, false);
  bytes.pixels.bits_allocated = 8;
  EXPECT_TRUE(says(refusal(stream, bytes), {"expected at most 8 bits a pixel, found 12"}));
  std::string three = stream;
  three[41] = 3;  // Csiz
  EXPECT_NE(refusal(three, kHeader), "no error");
  std::string coarse = stream;
  coarse[43] = 2;  // XRsiz
  EXPECT_TRUE(says(refusal(coarse, kHeader), {"subsampled"}));
}

/// A codestream in which the bytes at a place were replaced by others.
std::string with_bytes(std::string stream, std::size_t at, const std::string& bytes) {
  return stream.replace(at, bytes.size(), bytes);
}

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255);
  return bytes;
}

TEST(Jpeg2000, WhatWouldTakeFarMoreMemoryThanTheImageIsRefused) {
  const std::string stream = ball(96, 100).encode();
  constexpr std::size_t kWidth = 8, kTileWidth = 24;
  const std::string one = big_endian(1), huge = big_endian(0x7fffffff);
  EXPECT_TRUE(
      says(refusal(with_bytes(stream, kTileWidth, one + one), kHeader), {"at most 4096 tiles, found 100 x 96"}));
  EXPECT_TRUE(says(refusal(with_bytes(stream, kWidth, huge + huge), kHeader), {"1 to 65535 rows and columns"}));
  EXPECT_TRUE(says(refusal(with_bytes(with_bytes(stream, kWidth, huge + huge), kTileWidth, one + one), kHeader),
                   {"1 to 65535"}));
  EXPECT_TRUE(
      says(refusal(with_bytes(stream, kTileWidth, big_endian(0)), kHeader), {"tiles that begin with the image"}));
  // Precincts of 2 x 2 and layers without end: each a packet of a byte at least.
  const std::size_t style = stream.find("\xff\x52");
  const std::string tiny_precincts = with_bytes(stream, style + 4, std::string("\1", 1));
  std::string precincts =
      tiny_precincts.substr(0, style + 14) + std::string(6, '\x11') + tiny_precincts.substr(style + 14);
  precincts[style + 3] = static_cast<char>(precincts[style + 3] + 6);
  precincts[style + 7] = 9;  // layers
  EXPECT_TRUE(says(refusal(precincts, kHeader), {"packets", "truncated"}));
  EXPECT_TRUE(says(refusal(with_bytes(stream, style + 6, "\xff\xff"), kHeader), {"packets", "truncated"}));
  // One code-block of 4 x 4 for each 16 pixels of the largest image.
  const std::string large = with_bytes(with_bytes(stream, kWidth, big_endian(16384) + big_endian(16384)), kTileWidth,
                                       big_endian(16384) + big_endian(16384));
  EXPECT_TRUE(says(refusal(with_bytes(large, style + 10, std::string(2, '\0')), header_of(16384, 16384, 12, false)),
                   {"code-blocks"}));
}

TEST(Jpeg2000, MissingPartsAreNamed) {
  MadeCodestream made = ball(96, 100);
  made.change = [](auto& p) { p.tile_size_on = 1, p.cp_tdx = 50, p.cp_tdy = 96; };
  const std::string stream = made.encode();
  for (std::size_t size = 0; size < stream.size(); size += 1 + size / 20)
    EXPECT_NE(refusal(stream.substr(0, size), kHeader), "no error") << size;
  const std::size_t first = stream.find(std::string("\xff\x90\0\x0a\0\0", 6)),
                    second = stream.find(std::string("\xff\x90\0\x0a\0\1", 6));
  ASSERT_LT(first, second);
  EXPECT_TRUE(
      says(refusal(stream.substr(0, second) + "\xff\xd9", kHeader), {"expected 2 tiles, found none with number 2"}));
  EXPECT_TRUE(says(refusal(with_bytes(stream, second + 5, "\5"), kHeader), {"expected 2 tiles, found number 6"}));
  EXPECT_TRUE(says(
      refusal(stream.substr(0, first + 12) + stream.substr(stream.find("\xff\x52"), 14) + stream.substr(first + 12),
              kHeader),
      {"one coding style, found one for tile 1"}));
  EXPECT_TRUE(says(refusal(stream.substr(2), kHeader), {"expected a JPEG 2000 codestream"}));
  EXPECT_TRUE(says(refusal(with_bytes(stream, first + 6, big_endian(13)), kHeader),
                   {"expected a tile-part of more than 13 bytes"}));
}

TEST(Jpeg2000, CodestreamInAFileOfJpeg2000IsFound) {
  const MadeCodestream made = ball(96, 100);
  const std::string stream = made.encode(), signature = big_endian(12) + "jP  \r\n\x87\n";
  const std::string image = big_endian(30) + "jp2h" + std::string(22, '\0');
  const auto with_length = [&](std::uint32_t length) {
    return signature + image + big_endian(length) + "jp2c" + stream;
  };
  EXPECT_EQ(decode(with_length(static_cast<std::uint32_t>(stream.size() + 8)), kHeader), made.samples);
  EXPECT_EQ(decode(with_length(0), kHeader), made.samples);
  EXPECT_EQ(decode(signature + big_endian(1) + "jp2c" + big_endian(0) +
                       big_endian(static_cast<std::uint32_t>(stream.size() + 16)) + stream,
                   kHeader),
            made.samples);
  for (const std::uint32_t length : {2u, 7u, 0x7fffffffu})
    EXPECT_TRUE(says(refusal(with_length(length), kHeader), {"box"}));
}

TEST(Jpeg2000, NearlyEveryTurnedBitIsRefused) {
  const MadeCodestream made = ball(96, 100);
  const std::string stream = made.encode();
  std::minstd_rand random;
  int wrong = 0;
  constexpr int kTries = 300;
  for (int n = 0; n < kTries; ++n) {
    std::string turned = stream;
    turned[200 + random() % (stream.size() - 202)] ^= static_cast<char>(1 << random() % 8);
    try {
      wrong += decode(turned, kHeader) != made.samples;
    } catch (const InputError&) {
    }
  }
  EXPECT_LT(wrong, kTries / 10) << "of " << kTries;
}

TEST(Jpeg2000, HighThroughputGivesBackTheSamples) {
  const std::vector<std::uint16_t> words = busy_words(120);
  EXPECT_EQ(decode(high_throughput_frame(), header_of(10, 12, 12, false)),
            std::vector<int>(words.begin(), words.end()));
}

TEST(Jpeg2000, HighThroughputDataThatEndOpenJpegAreRefusedBeforeIt) {
  const std::string stream = high_throughput_frame();
  const DicomFileHeader header = header_of(10, 12, 12, false);
  const std::size_t data = stream.find("\xff\x93") + 2;
  EXPECT_TRUE(says(refusal(with_bytes(stream, data + 14, "\xff\xf1"), header), {"without markers, found fff1"}));
  EXPECT_TRUE(says(refusal(with_bytes(stream, stream.size() - 3, "\xff"), header), {"found ff at their end"}));
  for (std::size_t at = data; at + 3 < stream.size(); ++at)
    EXPECT_NE(refusal(with_bytes(stream, at, "\xff\x90"), header), "no error") << at;
}

}  // namespace
}  // namespace tetwarp
