// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Every depth, place and sign of a stored value in every coding, against the values that were put in.
#include "io/dicom/pixels/dicom_samples.h"

#include <gtest/gtest.h>

#include <dcmtk/dcmjpeg/djrploss.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <set>

#include "deform/errors.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"
#include "tests/support/dicom/coded_slices.h"
#include "tests/support/dicom/jpeg_writer.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;
using Values = std::vector<int>;

/// How a stored value lies in a word.
struct Layout {
  int allocated, stored, high_bit;
  bool is_signed;

  int lowest() const { return is_signed ? -(1 << (stored - 1)) : 0; }
  int highest() const { return lowest() + (1 << stored) - 1; }
  int shift() const { return high_bit + 1 - stored; }
  std::string name() const {
    return std::to_string(stored) + " bits to " + std::to_string(high_bit) + " of " + std::to_string(allocated) +
           (is_signed ? ", signed" : ", unsigned");
  }
};

std::vector<Layout> layouts() {
  std::vector<Layout> all;
  for (const int allocated : {8, 16}) {
    for (int stored = 1; stored <= allocated; ++stored) {
      for (const int high_bit : std::set{stored - 1, (stored + allocated) / 2 - 1, allocated - 1}) {
        for (const bool is_signed : {false, true}) all.push_back({allocated, stored, high_bit, is_signed});
      }
    }
  }
  return all;
}

constexpr int kRows = 5, kColumns = 7;  // an odd number of bytes

/// The ends of the range next to each other, the values around zero, and what no predictor guesses.
Values values_of(const Layout& layout) {
  Values values = {layout.lowest(), layout.highest(), layout.lowest(), 0};
  if (layout.is_signed) values.push_back(-1);
  std::minstd_rand random(static_cast<unsigned>(layout.stored));
  while (std::ssize(values) < kRows * kColumns)
    values.push_back(layout.lowest() + static_cast<int>(random() % (1u << layout.stored)));
  return values;
}

/// Words that hold the values, and noise in all bits that are no part of them, or nothing: the encoder of JPEG-LS
/// refuses what is larger than Bits Stored say.
std::vector<std::uint16_t> words_of(const Layout& layout, const Values& values, bool noisy = true) {
  const unsigned stored = ((1u << layout.stored) - 1) << layout.shift(), all = (1u << layout.allocated) - 1;
  std::minstd_rand random;
  std::vector<std::uint16_t> words;
  for (const int value : values) {
    const unsigned noise = noisy ? static_cast<unsigned>(random()) >> 8 : 0;
    words.push_back(static_cast<std::uint16_t>(
        ((static_cast<unsigned>(value) << layout.shift() & stored) | (noise & ~stored)) & all));
  }
  return words;
}

/// What is added to stored values so that HU fit int16.
int intercept(const Layout& layout) { return layout.highest() > INT16_MAX ? INT16_MIN : 0; }

MadeSlice slice_of(const Layout& layout, const Values& values) {
  MadeSlice slice;
  slice.rows = kRows;
  slice.columns = kColumns;
  slice.bits_allocated = layout.allocated;
  slice.bits_stored = layout.stored;
  slice.high_bit = layout.high_bit;
  slice.is_signed = layout.is_signed;
  slice.intercept = std::to_string(intercept(layout));
  slice.words = words_of(layout, values);
  return slice;
}

std::string even(std::string frame) { return frame.size() % 2 == 0 ? frame : frame + '\0'; }

/// A lossless JPEG frame of these numbers, which may lie beyond the precision.
std::string lossless_jpeg(int precision, const Values& samples) {
  JpegWriter writer(0xc3, kRows, kColumns, precision);
  writer.scan(1);
  for (std::size_t n = 0; n < samples.size(); ++n) {
    const int guess = n == 0 ? 1 << (precision - 1) : samples[n % kColumns == 0 ? n - kColumns : n - 1];
    writer.difference(static_cast<std::int16_t>(samples[n] - guess));
  }
  writer.marker(0xd9);
  return even(writer.bytes());
}

class PixelCodings : public testing::Test {
 protected:
  PixelCodings() { register_encoders(); }

  fs::path file() const { return folder_ / "slice.dcm"; }

  /// The stored values of the file.
  Values read(const Layout& layout) const {
    const DicomScan scan = scan_dicom(file(), true);
    Values values;
    for (const std::int16_t hu : load_dicom(scan.series.at(0), 1).volume.voxels)
      values.push_back(hu - intercept(layout));
    return values;
  }
  std::string refusal(const Layout& layout) const {
    try {
      read(layout);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }
  void write(const Layout& layout, const Values& values, const std::string& uid, const std::string& frame) const {
    write_encapsulated(file(), slice_of(layout, values), uid, {frame});
  }

  const Scratch folder_;
};

TEST(StoredBits, AreTheBitsBelowHighBitWithTheirSign) {
  std::minstd_rand random;
  for (int stored = 1; stored <= 32; ++stored) {
    for (int high_bit = stored - 1; high_bit < 32; ++high_bit) {
      for (int n = 0; n < 20; ++n) {
        const std::uint32_t word = static_cast<std::uint32_t>(random()) << 16 ^ static_cast<std::uint32_t>(random());
        std::int64_t value = 0;
        for (int bit = 0; bit < stored; ++bit) value += std::int64_t{word >> (high_bit + 1 - stored + bit) & 1} << bit;
        ASSERT_EQ(StoredBits(stored, high_bit, false).value(word), value) << stored << " to " << high_bit;
        if (value >> (stored - 1)) value -= std::int64_t{1} << stored;
        ASSERT_EQ(StoredBits(stored, high_bit, true).value(word), value) << stored << " to " << high_bit;
      }
    }
  }
}

TEST_F(PixelCodings, OfWholeWordsGiveTheStoredValuesInEveryDepthPlaceAndSign) {
  const E_TransferSyntax encodings[] = {
      EXS_LittleEndianExplicit, EXS_LittleEndianImplicit, EXS_BigEndianExplicit, EXS_DeflatedLittleEndianExplicit,
      EXS_RLELossless,          EXS_JPEGProcess14,        EXS_JPEGProcess14SV1,  EXS_JPEGLSLossless};
  for (const Layout& layout : layouts()) {
    SCOPED_TRACE(layout.name());
    const Values values = values_of(layout);
    MadeSlice slice = slice_of(layout, values);
    for (const E_TransferSyntax encoding : encodings) {
      if (encoding == EXS_JPEGLSLossless && layout.stored != layout.allocated) continue;  // DCMTK makes no such
      slice.encoding = encoding;
      slice.words = words_of(layout, values, encoding != EXS_JPEGLSLossless);
      write_slice(file(), slice);
      ASSERT_EQ(read(layout), values) << layout.name() << ", " << DcmXfer(encoding).getXferName();
    }
  }
}

TEST_F(PixelCodings, OfValuesAloneGiveThemInEveryDepthPlaceAndSign) {
  for (const Layout& layout : layouts()) {
    const Values values = values_of(layout);
    Values bits;
    for (const int value : values) bits.push_back(value & ((1 << layout.stored) - 1));
    for (const Values& samples : {values, bits}) {
      write(layout, values, UID_JPEGProcess14SV1TransferSyntax, lossless_jpeg(layout.stored, samples));
      ASSERT_EQ(read(layout), values) << layout.name();
    }
  }
}

// Where High Bit is Bits Stored - 1, as GDCM wants it; its JPEG wants all allocated bits stored as well.
TEST_F(PixelCodings, AreReadAsPydicomAndGdcmReadThem) {
  struct Written {
    Layout layout;
    fs::path file, out;
  };
  std::vector<Written> all;
  std::string command = TETWARP_PYTHON " " TETWARP_HU_OF;
  const auto keep = [&](const Layout& layout) {
    const std::string name = std::to_string(all.size());
    all.push_back({layout, folder_ / (name + ".dcm"), folder_ / name});
    fs::rename(file(), all.back().file);
    command += " '" + all.back().file.string() + "' '" + all.back().out.string() + "'";
  };
  for (const Layout& layout : layouts()) {
    // GDCM is at a loss with fewer than 8 bits, and with 8 in words of 16.
    if (layout.shift() != 0 || layout.stored < 8 || (layout.stored == 8 && layout.allocated == 16)) continue;
    const Values values = values_of(layout);
    MadeSlice slice = slice_of(layout, values);
    for (const E_TransferSyntax encoding : {EXS_RLELossless, EXS_JPEGLSLossless, EXS_JPEGProcess14SV1}) {
      if (encoding == EXS_JPEGProcess14SV1 && layout.stored != layout.allocated) continue;
      if (encoding == EXS_JPEGLSLossless && layout.stored != layout.allocated) continue;  // DCMTK makes no such
      slice.encoding = encoding;
      slice.words = words_of(layout, values, encoding != EXS_JPEGLSLossless);
      write_slice(file(), slice);
      keep(layout);
    }
#ifdef TETWARP_WITH_OPENJPEG
    const MadeCodestream stream{
        kRows, kColumns, layout.stored, layout.is_signed, values, [](auto& p) { p.numresolution = 2; }};
    write(layout, values, UID_JPEG2000LosslessOnlyTransferSyntax, even(stream.encode()));
    keep(layout);
#endif
  }
  const int status = std::system(command.c_str());
  if (WIFEXITED(status) && WEXITSTATUS(status) == 77) GTEST_SKIP() << "pydicom or GDCM is not installed";
  ASSERT_EQ(status, 0) << command;
  for (const Written& one : all) {
    const std::string bytes = read_bytes(one.out);
    std::vector<double> expected(bytes.size() / sizeof(double));
    std::memcpy(expected.data(), bytes.data(), bytes.size());
    const std::vector<std::int16_t> found = load_dicom(scan_dicom(one.file, true).series.at(0), 1).volume.voxels;
    ASSERT_EQ(std::vector<double>(found.begin(), found.end()), expected) << one.layout.name();
  }
}

// Decoders give negative samples as numbers of 16 or 32 bits: of 8 bits allocated, words up to 0xffff.
TEST_F(PixelCodings, SignMayReachBeyondTheAllocatedBits) {
  const Layout layout{8, 8, 7, true};
  const Values values = values_of(layout);
  write(layout, values, UID_JPEGProcess14TransferSyntax, lossless_jpeg(8, values));
  EXPECT_EQ(read(layout), values);
#ifdef TETWARP_WITH_OPENJPEG
  write(layout, values, UID_JPEG2000LosslessOnlyTransferSyntax,
        even(MadeCodestream{kRows, kColumns, 8, true, values, [](auto& p) { p.numresolution = 2; }}.encode()));
  EXPECT_EQ(read(layout), values);
#endif
}

TEST_F(PixelCodings, PrecisionThatIsNeitherThatOfTheValueNorOfTheWordIsRefused) {
  const Layout layout{16, 10, 13, false};
  const Values values = values_of(layout);
  for (const int precision : {11, 12, 13}) {
    write(layout, values, UID_JPEGProcess14SV1TransferSyntax, lossless_jpeg(precision, values));
    EXPECT_TRUE(says(refusal(layout), {"slice.dcm", "10 Bits Stored", "found " + std::to_string(precision)}));
  }
  for (const int precision : {10, 14, 16}) {
    Values samples = values;
    for (int& sample : samples) sample <<= precision > 10 ? layout.shift() : 0;
    write(layout, values, UID_JPEGProcess14SV1TransferSyntax, lossless_jpeg(precision, samples));
    EXPECT_EQ(read(layout), values) << precision;
  }
  const Layout bytes{8, 8, 7, false};
  write(bytes, values_of(bytes), UID_JPEGProcess14SV1TransferSyntax, lossless_jpeg(9, values_of(bytes)));
  EXPECT_TRUE(says(refusal(bytes), {"slice.dcm", "at most 8 bits a pixel, found 9"}));
}

#ifdef TETWARP_WITH_OPENJPEG

TEST_F(PixelCodings, OfJpeg2000GiveTheStoredValuesInEveryDepthPlaceAndSign) {
  for (const Layout& layout : layouts()) {
    const Values values = values_of(layout);
    Values words;
    const StoredBits whole(layout.allocated, layout.allocated - 1, layout.is_signed);
    for (const std::uint16_t word : words_of(layout, values)) words.push_back(static_cast<int>(whole.value(word)));
    for (const auto& [precision, samples] : {std::pair{layout.stored, values}, {layout.allocated, words}}) {
      const MadeCodestream stream{
          kRows, kColumns, precision, layout.is_signed, samples, [](auto& p) { p.numresolution = 2; }};
      write(layout, values, UID_JPEG2000LosslessOnlyTransferSyntax, even(stream.encode()));
      ASSERT_EQ(read(layout), values) << layout.name() << ", precision " << precision;
    }
  }
}

TEST_F(PixelCodings, OfLossyJpeg2000AreNearTheStoredValuesOfEitherSign) {
  for (const Layout& layout : {Layout{8, 8, 7, true},
                               {8, 8, 7, false},
                               {16, 12, 11, true},
                               {16, 12, 15, true},
                               {16, 12, 15, false},
                               {16, 16, 15, true}}) {
    Values values;
    for (int n = 0; n < kRows * kColumns; ++n) values.push_back((layout.lowest() + layout.highest()) / 2 + n - 17);
    const MadeCodestream stream{kRows, kColumns, layout.stored, layout.is_signed, values, [](auto& p) {
                                  p.numresolution = 2;
                                  p.irreversible = 1;
                                }};
    write(layout, values, UID_JPEG2000TransferSyntax, even(stream.encode()));
    const Values found = read(layout);
    for (std::size_t n = 0; n < values.size(); ++n) ASSERT_NEAR(found[n], values[n], 3) << layout.name();
  }
}

#endif

// DCMTK stretches the values over all bits and says so in Rescale Slope and Intercept.
TEST_F(PixelCodings, OfACosineTransformAreNearTheValues) {
  const DJ_RPLossy parameter(100);
  Values values;
  for (int n = 0; n < kRows * kColumns; ++n) values.push_back(100 + 3 * (n % kColumns) + 2 * (n / kColumns));
  for (const auto& [encoding, layout] : {std::pair{EXS_JPEGProcess1, Layout{8, 8, 7, false}},
                                         {EXS_JPEGProcess1, Layout{16, 12, 11, true}},
                                         {EXS_JPEGProcess2_4, Layout{16, 12, 11, false}},
                                         {EXS_JPEGProcess6_8, Layout{16, 12, 15, true}},
                                         {EXS_JPEGProcess10_12, Layout{16, 12, 11, false}}}) {
    MadeSlice slice = slice_of(layout, values);
    slice.encoding = encoding;
    slice.encoder_parameter = &parameter;
    write_slice(file(), slice);
    const Values found = read(layout);
    for (std::size_t n = 0; n < values.size(); ++n)
      ASSERT_NEAR(found[n], values[n], 1) << DcmXfer(encoding).getXferName() << ", " << layout.name();
  }
}

TEST_F(PixelCodings, OfEightBitsMayLieInWordsOfSixteen) {
  const Layout narrow{8, 8, 7, false};
  const Values values = values_of(narrow);
  for (const E_TransferSyntax encoding :
       {EXS_JPEGProcess1, EXS_JPEGProcess10_12, EXS_JPEGProcess14, EXS_JPEGLSLossless, EXS_JPEGLSLossy}) {
    const std::string frame = even(encoded_frame(folder_.path(), slice_of(narrow, values), encoding));
    write(narrow, values, DcmXfer(encoding).getXferID(), frame);
    const Values expected = read(narrow);
    for (const Layout& layout : {Layout{16, 8, 7, false}, {16, 8, 15, false}, {16, 12, 11, false}}) {
      write(layout, values, DcmXfer(encoding).getXferID(), frame);
      ASSERT_EQ(read(layout), expected) << layout.name() << ", " << DcmXfer(encoding).getXferName();
    }
  }
}

TEST_F(PixelCodings, SignIsThatOfPixelRepresentationOrRefused) {
  const Layout layout{16, 12, 11, true};
  const Values values = values_of(layout);
  MadeSlice slice = slice_of(layout, values);
  slice.edit = [](DcmDataset& data) { data.putAndInsertUint16(DCM_PixelRepresentation, 2); };
  write_slice(file(), slice);
  EXPECT_TRUE(says(refusal(layout), {"Pixel Representation (0028,0103)", "expected 0 or 1, found 2", "slice.dcm"}));
  slice.edit = [](DcmDataset& data) { delete data.remove(DCM_PixelRepresentation); };
  write_slice(file(), slice);
  EXPECT_TRUE(says(refusal(layout), {"Pixel Representation (0028,0103)", "expected 0 or 1, found none", "slice.dcm"}));
}

}  // namespace
}  // namespace tetwarp
