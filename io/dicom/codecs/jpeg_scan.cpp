// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/codecs/jpeg_scan.h"

#include <algorithm>
#include <map>

namespace tetwarp {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kBaseline = 0xc0, kExtended = 0xc1, kLossless = 0xc3, kTables = 0xc4, kEnd = 0xd9, kScan = 0xda,
                       kRestart = 0xd0, kRestartInterval = 0xdd;

bool is_frame(std::uint8_t marker) {
  return marker == 0xf7 || (marker >= 0xc0 && marker <= 0xcf && marker != kTables && marker != 0xc8 && marker != 0xcc);
}

int word(Bytes bytes, std::size_t at) { return bytes[at] * 256 + bytes[at + 1]; }

/// Segments between the start of the image and the coded data.
class Segments {
 public:
  explicit Segments(Bytes stream) : stream_(stream) {}

  /// Goes to the next segment. @return whether there is one
  bool next() {
    marker_ = 0;
    bytes_ = {};
    // Bytes 0xff before a marker are fill bytes.
    while (at_ + 1 < stream_.size() && stream_[at_] == 0xff && stream_[at_ + 1] == 0xff) ++at_;
    if (at_ + 4 > stream_.size() || stream_[at_] != 0xff) return false;
    const auto length = static_cast<std::size_t>(word(stream_, at_ + 2));
    if (length < 2 || length - 2 > stream_.size() - at_ - 4) return false;
    marker_ = stream_[at_ + 1];
    bytes_ = stream_.subspan(at_ + 4, length - 2);
    at_ += 2 + length;
    return true;
  }
  std::uint8_t marker() const { return marker_; }
  /// The segment without its marker and its length.
  Bytes bytes() const { return bytes_; }
  Bytes behind() const { return stream_.subspan(at_); }

 private:
  Bytes stream_, bytes_;
  std::size_t at_ = 2;
  std::uint8_t marker_ = 0;
};

JpegFrame frame_of(std::uint8_t marker, Bytes bytes) {
  if (bytes.size() < 6) return {};
  return {word(bytes, 1), word(bytes, 3), bytes[0], bytes[5], marker};
}

/// Adds Huffman tables to `tables`, each under 16 times its class (0: DC or lossless, 1: AC) plus its number (T.81
/// B.2.4.2). @return whether the tables are whole
bool read_tables(Bytes bytes, std::map<int, JpegCodes>& tables) {
  while (!bytes.empty()) {
    if (bytes.size() < 17) return false;
    const auto counts = bytes.subspan<1, 16>();
    std::size_t values = 0;
    for (int length = 1, room = 1; length <= 16; ++length) {
      room = 2 * room - counts[length - 1];  // codes of this length that are still free
      if (room < 0) return false;
      values += counts[length - 1];
    }
    if (values > 256 || bytes.size() < 17 + values) return false;
    tables.insert_or_assign(bytes[0], JpegCodes(counts, bytes.subspan(17, values)));
    bytes = bytes.subspan(17 + values);
  }
  return true;
}

std::string damaged(const std::string& unit, std::size_t n) {
  return "the coded data are damaged, which shows in " + unit + " " + std::to_string(n + 1);
}

/// Takes the restart marker at the end of an interval. @param index  restart markers before this one
/// @return whether it is the marker that has to come here
bool is_restart(JpegBits& bits, std::size_t index) {
  return bits.is_used_up() && bits.next_marker() == kRestart + index % 8;
}

std::string end_problem(JpegBits& bits) {
  if (bits.is_short()) return "the coded data are damaged: there are too few";
  if (!bits.is_used_up() || bits.next_marker() != kEnd) return "the coded data are damaged: some are left over";
  return {};
}

/// Takes the next difference (T.81 H.1.2.2). @param is_code  set to false where the bits are no code
int difference(const JpegScan& scan, JpegBits& bits, bool& is_code) {
  const int size = scan.dc.next(bits);
  if (size == 0) return 0;
  if (size == 16) return 32768;
  if (size < 0 || size > 16) {
    is_code = false;
    return 0;
  }
  const int value = static_cast<int>(bits.take(size));
  return value < 1 << (size - 1) ? value - (1 << size) + 1 : value;
}

/// The value that a predictor of T.81 Table H.1 gives.
/// @param a, b, c  samples on the left, above, and above on the left
int predicted(int predictor, int a, int b, int c) {
  switch (predictor) {
    case 1: return a;
    case 2: return b;
    case 3: return c;
    case 4: return a + b - c;
    case 5: return a + ((b - c) >> 1);
    case 6: return b + ((a - c) >> 1);
    default: return (a + b) >> 1;
  }
}

/// Decodes one row, whose first sample was predicted in another way and is given.
template <int predictor>
bool decode_row(const JpegScan& scan, JpegBits& bits, int first, const std::uint16_t* above,
                std::span<std::uint16_t> row) {
  bool is_code = true;
  auto left = static_cast<std::uint16_t>(first + difference(scan, bits, is_code));
  row[0] = left;
  for (std::size_t i = 1; i < row.size(); ++i) {
    const int guess = predictor == 1 ? left : predicted(predictor, left, above[i], above[i - 1]);
    left = static_cast<std::uint16_t>(guess + difference(scan, bits, is_code));
    row[i] = left;
  }
  return is_code && !bits.is_short();
}

bool decode_row(int predictor, const JpegScan& scan, JpegBits& bits, int first, const std::uint16_t* above,
                std::span<std::uint16_t> row) {
  switch (predictor) {
    case 1: return decode_row<1>(scan, bits, first, above, row);
    case 2: return decode_row<2>(scan, bits, first, above, row);
    case 3: return decode_row<3>(scan, bits, first, above, row);
    case 4: return decode_row<4>(scan, bits, first, above, row);
    case 5: return decode_row<5>(scan, bits, first, above, row);
    case 6: return decode_row<6>(scan, bits, first, above, row);
    default: return decode_row<7>(scan, bits, first, above, row);
  }
}

/// Whether all samples have at most `bits` bits, or, with a sign, all bits above these equal the sign.
bool fit(std::span<const std::uint16_t> samples, int bits, bool is_signed) {
  const auto beyond = static_cast<std::uint16_t>(0xffff << bits),
             sign = static_cast<std::uint16_t>(beyond | beyond >> 1);
  return std::all_of(samples.begin(), samples.end(), [=](std::uint16_t sample) {
    return (sample & beyond) == 0 || (is_signed && (sample & sign) == sign);
  });
}

/// Reads the codes of one block of 8 x 8 coefficients. @return whether they make a block
bool pass_block(const JpegScan& scan, JpegBits& bits) {
  const int dc_size = scan.dc.next(bits);
  if (dc_size < 0 || dc_size > 15) return false;
  bits.take(dc_size);
  for (int k = 1; k < 64; ++k) {
    const int code = scan.ac.next(bits);
    if (code < 0) return false;
    const int run = code >> 4, size = code & 15;
    if (size == 0 && run != 15) return run == 0;  // an end-of-block code
    k += run;
    if (k > 63) return false;
    bits.take(size);
  }
  return true;
}

}  // namespace

JpegFrame jpeg_frame(Bytes stream) {
  Segments segments(stream);
  while (segments.next()) {
    if (is_frame(segments.marker())) return frame_of(segments.marker(), segments.bytes());
  }
  return {};
}

bool is_one_scan(const JpegFrame& frame) {
  return frame.components == 1 && (frame.marker == kBaseline || frame.marker == kExtended || frame.marker == kLossless);
}

JpegScan read_jpeg_scan(Bytes stream, std::string& problem) {
  JpegScan scan;
  std::map<int, JpegCodes> tables;
  Segments segments(stream);
  while (segments.next() && segments.marker() != kScan && problem.empty()) {
    const Bytes bytes = segments.bytes();
    if (is_frame(segments.marker())) {
      if (scan.frame.marker != 0) problem = "expected one frame header, found two";
      scan.frame = frame_of(segments.marker(), bytes);
    } else if (segments.marker() == kTables && !read_tables(bytes, tables)) {
      problem = "expected tables of Huffman codes, found damaged ones";
    } else if (segments.marker() == kRestartInterval && bytes.size() >= 2) {
      scan.restart_interval = word(bytes, 0);
    }
  }
  if (!problem.empty()) return scan;
  // Component, tables, predictor or first coefficient, last coefficient, shifts (T.81 B.2.3).
  const Bytes header = segments.bytes();
  if (segments.marker() != kScan || header.size() < 6 || header[0] != 1) {
    problem = "expected a scan of one component, found none";
    return scan;
  }
  if (scan.frame.marker == 0) {
    problem = "expected a frame header before the scan, found none";
    return scan;
  }
  const bool is_lossless = scan.frame.marker == kLossless;
  const auto dc = tables.find(header[2] >> 4), ac = tables.find(16 + (header[2] & 15));
  if (dc == tables.end() || (!is_lossless && ac == tables.end())) {
    problem = "expected tables of Huffman codes, found none";
    return scan;
  }
  scan.dc = dc->second;
  if (!is_lossless) scan.ac = ac->second;
  scan.predictor = header[3];
  scan.transform = header[5] & 15;
  if (is_lossless && (scan.predictor < 1 || scan.predictor > 7 || scan.transform >= scan.frame.precision))
    problem = "expected predictor 1 to 7, found " + std::to_string(scan.predictor);
  scan.coded = segments.behind();
  return scan;
}

std::string decode_lossless(const JpegScan& scan, bool is_signed, std::span<std::uint16_t> samples) {
  const auto columns = static_cast<std::size_t>(scan.frame.columns), rows = static_cast<std::size_t>(scan.frame.rows);
  const auto interval = static_cast<std::size_t>(scan.restart_interval) / columns;  // rows between restart markers
  if (interval * columns != static_cast<std::size_t>(scan.restart_interval))
    return "expected a restart interval of whole rows, found " + std::to_string(scan.restart_interval) + " samples";
  JpegBits bits(scan.coded);
  const int bits_kept = scan.frame.precision - scan.transform, middle = 1 << (bits_kept - 1);
  for (std::size_t j = 0; j < rows; ++j) {
    const bool is_first = interval == 0 ? j == 0 : j % interval == 0;
    if (is_first && j > 0 && !is_restart(bits, j / interval - 1)) return damaged("row", j);
    const std::span<std::uint16_t> row = samples.subspan(j * columns, columns);
    const std::uint16_t* above = is_first ? nullptr : row.data() - columns;
    const bool is_whole = is_first ? decode_row(1, scan, bits, middle, nullptr, row)
                                   : decode_row(scan.predictor, scan, bits, above[0], above, row);
    if (!is_whole || !fit(row, bits_kept, is_signed)) return damaged("row", j);
  }
  for (std::uint16_t& sample : samples) sample = static_cast<std::uint16_t>(sample << scan.transform);
  return end_problem(bits);
}

std::string sequential_problem(const JpegScan& scan) {
  const auto blocks = [](int pixels) { return static_cast<std::size_t>((pixels + 7) / 8); };
  const std::size_t count = blocks(scan.frame.columns) * blocks(scan.frame.rows);
  const auto interval = static_cast<std::size_t>(scan.restart_interval);
  JpegBits bits(scan.coded);
  for (std::size_t n = 0; n < count; ++n) {
    if (interval > 0 && n > 0 && n % interval == 0 && !is_restart(bits, n / interval - 1)) return damaged("block", n);
    if (!pass_block(scan, bits) || bits.is_short()) return damaged("block", n);
  }
  return end_problem(bits);
}

}  // namespace tetwarp
