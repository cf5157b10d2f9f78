// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

/// Writes JPEG frames of one component, coded with one Huffman table in which every size has a code of 5 bits that
/// equals it.
class JpegWriter {
 public:
  JpegWriter(std::uint8_t marker, int rows, int columns, int precision, int restart_interval = 0) {
    bytes_ = std::string("\xff\xd8", 2);
    segment(marker, {precision, rows >> 8, rows & 255, columns >> 8, columns & 255, 1, 1, 0x11, 0});
    std::vector<int> table{0, 0, 0, 0, 0, 17};
    table.resize(17);
    for (int size = 0; size <= 16; ++size) table.push_back(size);
    segment(0xc4, table);
    table[0] = 0x10;
    segment(0xc4, table);
    if (marker != 0xc3) segment(0xdb, std::vector<int>(65, 1));
    if (marker != 0xc3) bytes_[bytes_.size() - 65] = '\0';  // the number of the table
    if (restart_interval > 0) segment(0xdd, {restart_interval >> 8, restart_interval & 255});
  }
  void scan(int predictor, int transform = 0) {
    segment(0xda, {1, 1, 0, predictor, predictor > 0 ? 0 : 63, transform});
  }

  void bits(int value, int count) {
    for (int n = count - 1; n >= 0; --n) {
      byte_ = byte_ << 1 | (value >> n & 1);
      if (++filled_ < 8) continue;
      bytes_ += static_cast<char>(byte_);
      if (byte_ == 0xff) bytes_ += '\0';
      byte_ = filled_ = 0;
    }
  }
  void difference(int value) {
    int size = 0;
    for (int rest = std::abs(value); rest > 0; rest >>= 1) ++size;
    bits(size, 5);
    if (size < 16) bits(value < 0 ? value + (1 << size) - 1 : value, size);
  }
  /// Fills the last byte with bits of `fill` and writes a marker.
  void marker(int code, int fill = 1) {
    while (filled_ != 0) bits(fill, 1);
    bytes_ += '\xff';
    bytes_ += static_cast<char>(code);
  }
  std::string bytes() const { return bytes_; }

 private:
  void segment(int code, const std::vector<int>& content) {
    bytes_ += '\xff';
    bytes_ += static_cast<char>(code);
    bytes_ += '\0';
    bytes_ += static_cast<char>(content.size() + 2);
    bytes_.append(content.begin(), content.end());
  }

  std::string bytes_;
  int byte_ = 0, filled_ = 0;
};
