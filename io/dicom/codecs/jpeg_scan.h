// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: JPEG streams (ITU-T T.81) of one component in one scan: their headers, and their coded data bit by
// bit.
#include <cstdint>
#include <span>
#include <string>

#include "io/dicom/codecs/jpeg_bits.h"

namespace tetwarp {

/// A frame header of JPEG (T.81 B.2.2) or of JPEG-LS (T.87 C.2.2); all zeros if the stream has none.
struct JpegFrame {
  int rows = 0, columns = 0, precision = 0, components = 0;
  std::uint8_t marker = 0;  ///< 0xc0 baseline, 0xc1 extended, 0xc2 progressive, 0xc3 lossless, 0xf7 JPEG-LS
};
JpegFrame jpeg_frame(std::span<const std::uint8_t> stream);

/// Whether `read_jpeg_scan` can read the coded data of such a frame.
bool is_one_scan(const JpegFrame& frame);

/// A frame with one scan, ready to be decoded.
struct JpegScan {
  JpegFrame frame;
  JpegCodes dc, ac;  ///< Huffman tables; lossless frames use `dc` alone
  /// For lossless frames, the number of the predictor, and by how many bits samples were shifted down (T.81 H.1).
  int predictor = 0, transform = 0;
  int restart_interval = 0;  ///< samples or blocks between two restart markers; 0: there are none
  std::span<const std::uint8_t> coded;
};

/// Reads the headers of a stream up to the coded data of its scan.
/// @param problem  set to why the stream cannot be read; empty: it can
JpegScan read_jpeg_scan(std::span<const std::uint8_t> stream, std::string& problem);

/// Decodes a lossless scan (T.81 Annex H), row by row.
/// @param is_signed  samples may have the sign in all bits above the precision
/// @param samples  rows x columns of the frame
/// @return why the scan cannot be decoded: bits that are no code, data that are missing or left over, samples that are
/// larger than the precision allows; empty if it was decoded
std::string decode_lossless(const JpegScan& scan, bool is_signed, std::span<std::uint16_t> samples);

/// Why the blocks of a sequential scan (T.81 F.2.2) are damaged: bits that are no code, coefficients beyond the last,
/// data that are missing or left over; empty if no damage shows. A library's decoder would make up pixels for these.
std::string sequential_problem(const JpegScan& scan);

}  // namespace tetwarp
