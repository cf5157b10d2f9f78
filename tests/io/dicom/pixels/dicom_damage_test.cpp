// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Real compressed slices with a bit turned, or with a sector of a disk lost: how often that shows. No coding of DICOM
// has a checksum, so that some damage never does; docs/reference/dicom.md has the numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "deform/errors.h"
#include "io/dicom_series.h"
#include "tests/support/image_samples.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

struct Damaged {
  std::string name, file;
  /// The most damaged frames, of all that are tried, that may be decoded without an error: with a turned bit, with
  /// bytes lost.
  int most_turned, most_lost;
  double worst_share = 1;  ///< the largest share of pixels that may be wrong where a turned bit is not found
  friend void PrintTo(const Damaged& damaged, std::ostream* stream) { *stream << damaged.name; }
};

constexpr int kTurned = 40, kLost = 15;

class DamagedSlice : public testing::TestWithParam<Damaged> {
 protected:
  std::vector<std::int16_t> load(const std::string& bytes) {
    write_file(folder_ / "slice.dcm", bytes);
    const DicomScan scan = scan_dicom(folder_ / "slice.dcm", true);
    if (scan.series.empty()) throw InputError(to_string(scan.skipped.at(0)));
    return load_dicom(scan.series[0], 1).volume.voxels;
  }

  /// The share of pixels that differ; 0: none, or it was refused.
  double wrong_share(const std::string& bytes, const std::vector<std::int16_t>& whole) {
    try {
      const std::vector<std::int16_t> found = load(bytes);
      std::size_t wrong = 0;
      for (std::size_t n = 0; n < whole.size(); ++n) wrong += found.at(n) != whole[n];
      return static_cast<double>(wrong) / static_cast<double>(whole.size());
    } catch (const InputError&) {
      return 0;
    }
  }

  const Scratch folder_;
};

TEST_P(DamagedSlice, IsRefusedAsOftenAsItsCodingAllows) {
  TETWARP_REAL_DATA(set, fs::path(GetParam().file).parent_path().string());
  const std::string whole = read_bytes(set / fs::path(GetParam().file).filename());
  const std::vector<std::int16_t> hu = load(whole);
  const std::size_t begin = whole.size() / 5, end = whole.size() - 600;  // within the coded data
  std::minstd_rand random(7);
  int turned_unseen = 0, lost_unseen = 0;
  double worst = 0;
  for (int n = 0; n < kTurned; ++n) {
    std::string bytes = whole;
    bytes[begin + random() % (end - begin)] ^= static_cast<char>(1 << random() % 8);
    const double share = wrong_share(bytes, hu);
    turned_unseen += share > 0;
    worst = std::max(worst, share);
  }
  for (int n = 0; n < kLost; ++n) {
    std::string bytes = whole;
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(begin + random() % (end - begin)), 512, '\0');
    lost_unseen += wrong_share(bytes, hu) > 0;
  }
  EXPECT_LE(turned_unseen, GetParam().most_turned);
  EXPECT_LE(lost_unseen, GetParam().most_lost);
  EXPECT_LE(worst, GetParam().worst_share);
  RecordProperty("turned_unseen", turned_unseen);
  RecordProperty("lost_unseen", lost_unseen);
}

std::string one_slice(const std::string& syntax) { return "ct-transfer-syntaxes/CTImage.dcm_" + syntax + ".dcm"; }

const std::vector<Damaged> kDamaged = {
#ifdef TETWARP_WITH_OPENJPEG
    {"Jpeg2000Lossless", one_slice("JPEG2000LosslessOnlyTransferSyntax_1.2.840.10008.1.2.4.90"), 4, 0},
    {"Jpeg2000Lossy", one_slice("JPEG2000TransferSyntax_1.2.840.10008.1.2.4.91"), 4, 0},
    {"Jpeg2000OfKakadu", "abdomen-j2k-20/CT.1.3.12.2.1107.5.1.4.60064.30000022120808113428000016580", 4, 0},
#endif
    {"JpegLs", one_slice("JPEGLSLosslessTransferSyntax_1.2.840.10008.1.2.4.80"), 4, 0, 0.001},
    {"JpegLsLossy", one_slice("JPEGLSLossyTransferSyntax_1.2.840.10008.1.2.4.81"), 4, 0, 0.001},
    // What is left is wrong in the rest of a row; with another predictor than the pixel before, also below it.
    {"Jpeg14Sv1", one_slice("JPEGProcess14SV1TransferSyntax_1.2.840.10008.1.2.4.70"), 34, 0, 0.002},
    {"Jpeg14Sv1Sagittal", "sagittal-with-scout/1-010.dcm", 30, 0, 0.002},
    {"Jpeg14", one_slice("JPEGProcess14TransferSyntax_1.2.840.10008.1.2.4.57"), 34, 0, 0.5},
    {"Jpeg1", one_slice("JPEGProcess1TransferSyntax_1.2.840.10008.1.2.4.50"), 36, 2},
    {"Jpeg2And4", one_slice("JPEGProcess2_4TransferSyntax_1.2.840.10008.1.2.4.51"), 38, 4},
    {"Jpeg6And8", one_slice("JPEGProcess6_8TransferSyntax_1.2.840.10008.1.2.4.53"), 40, 5},
    {"Jpeg10And12", one_slice("JPEGProcess10_12TransferSyntax_1.2.840.10008.1.2.4.55"), 36, 8},
    {"Rle", one_slice("RLELosslessTransferSyntax_1.2.840.10008.1.2.5"), 40, 0, 0.001},
    {"Deflated", one_slice("DeflatedExplicitVRLittleEndianTransferSyntax_1.2.840.10008.1.2.1.99"), 36, 0, 0.01},
};

INSTANTIATE_TEST_SUITE_P(Real, DamagedSlice, testing::ValuesIn(kDamaged),
                         [](const auto& damaged) { return damaged.param.name; });

}  // namespace
}  // namespace tetwarp
