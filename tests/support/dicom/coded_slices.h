// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "tests/support/dicom/encapsulated.h"
#include "tests/support/dicom/encoders.h"
#ifdef TETWARP_WITH_OPENJPEG
#include "tests/support/dicom/jpeg2000_maker.h"
#endif

/// Numbers from 0 to 4095 that no predictor guesses.
inline std::vector<std::uint16_t> busy_words(int count) {
  std::vector<std::uint16_t> words;
  for (int i = 0; i < count; ++i) words.push_back(static_cast<std::uint16_t>((i * 7919) % 4096));
  return words;
}

/// A slice of 10 rows and 12 columns of 12 bits; HU are the stored values.
inline MadeSlice busy_slice() {
  MadeSlice slice;
  slice.rows = 10;
  slice.columns = 12;
  slice.bits_stored = 12;
  slice.high_bit = 11;
  slice.is_signed = false;
  slice.intercept = "0";
  slice.words = busy_words(120);
  return slice;
}

/// `busy_slice` in high-throughput JPEG 2000, which no library of Debian 12 but OpenJPH's own encodes: made by
/// `ojph_compress -reversible true -num_decomps 2` of OpenJPH 0.9.0 from the slice as PGM; `ojph_expand` gives it back.
inline std::string high_throughput_frame() {
  const std::string hex =
      "ff4fff51002940000000000c0000000a00000000000000000000000c0000000a000000000000000000010b0101ff500008000200000007"
      "ff52000c00020001000204044001ff5c000a2070787878707078ff64001600014f70656e4a50482056657220302e392e302eff90000a00"
      "00000000ea0001ff93c0016a80c784930ee7c0d2ed5bde02f700188bcc64017b3900c000b520005a10002bc08f0c7c7fbd7add277f4bf3"
      "014217fc42017b39008f68156f4cb83c5c20fe00a5037f36001ffbdb5ffec7077ee500a4037f3600c00175f0005d7c000b78fefbcfff7f"
      "ef7ffcf73fc410fde73fff7cdf7ffcf73fff045188fcfdff2788fc027a41817eb09ca2402c84011b3f00ff637ff9cfbfff791fff657fff"
      "0fff6a3ff8c77fff2fff6a3f98d9cc666666667a5913f6cf49c1c19c424280ae3d00ff77ff7fff7fff7b7fff737ffef7df00c3f8288cc6"
      "0050cc0d1900463f00ffd9";
  std::string bytes;
  for (std::size_t n = 0; n < hex.size(); n += 2) bytes += static_cast<char>(std::stoi(hex.substr(n, 2), nullptr, 16));
  return bytes;
}

/// How `busy_slice` is compressed in one transfer syntax.
struct Coding {
  std::string name, uid;
  E_TransferSyntax encoding = EXS_Unknown;  ///< encoding that an encoder of DCMTK makes
  int bits = 12;
  bool is_lossless = true;

  MadeSlice slice() const {
    MadeSlice slice = busy_slice();
    if (bits == 8) {
      slice.bits_allocated = slice.bits_stored = 8;
      slice.high_bit = 7;
      for (std::uint16_t& word : slice.words) word &= 255;
    }
    return slice;
  }
  std::string frame(const std::filesystem::path& scratch) const { return frame(scratch, slice()); }
  /// The compressed frame of a slice with other words. High-throughput JPEG 2000 has one frame only, that of
  /// busy_slice.
  std::string frame(const std::filesystem::path& scratch, const MadeSlice& of) const {
    if (encoding != EXS_Unknown) return encoded_frame(scratch, of, encoding);
#ifdef TETWARP_WITH_OPENJPEG
    if (name.starts_with("Jpeg2000")) {
      const std::vector<std::uint16_t>& words = of.words;
      MadeCodestream stream{10, 12, 12, false, {words.begin(), words.end()}, {}};
      stream.change = [&](opj_cparameters_t& parameters) {
        parameters.numresolution = 3;
        parameters.irreversible = is_lossless ? 0 : 1;
      };
      return stream.encode();
    }
#endif
    return high_throughput_frame();
  }
};

/// Every compressed transfer syntax that this build decodes.
inline std::vector<Coding> codings() {
  std::vector<Coding> all = {{"Rle", UID_RLELosslessTransferSyntax, EXS_RLELossless},
                             {"Jpeg1", UID_JPEGProcess1TransferSyntax, EXS_JPEGProcess1, 8, false},
                             {"Jpeg2And4", UID_JPEGProcess2_4TransferSyntax, EXS_JPEGProcess2_4, 12, false},
                             {"Jpeg6And8", UID_JPEGProcess6_8TransferSyntax, EXS_JPEGProcess6_8, 12, false},
                             {"Jpeg10And12", UID_JPEGProcess10_12TransferSyntax, EXS_JPEGProcess10_12, 12, false},
                             {"Jpeg14", UID_JPEGProcess14TransferSyntax, EXS_JPEGProcess14},
                             {"Jpeg14Sv1", UID_JPEGProcess14SV1TransferSyntax, EXS_JPEGProcess14SV1},
                             {"JpegLs", UID_JPEGLSLosslessTransferSyntax, EXS_JPEGLSLossless},
                             {"JpegLsLossy", UID_JPEGLSLossyTransferSyntax, EXS_JPEGLSLossy, 12, false}};
#ifdef TETWARP_WITH_OPENJPEG
  all.push_back({"Jpeg2000", UID_JPEG2000LosslessOnlyTransferSyntax});
  all.push_back({"Jpeg2000Lossy", UID_JPEG2000TransferSyntax, EXS_Unknown, 12, false});
  all.push_back({"HighThroughput", "1.2.840.10008.1.2.4.201"});
  all.push_back({"HighThroughputRpcl", "1.2.840.10008.1.2.4.202"});
  all.push_back({"HighThroughputAny", "1.2.840.10008.1.2.4.203"});
#endif
  return all;
}

inline void PrintTo(const Coding& coding, std::ostream* stream) { *stream << coding.name; }
