// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: Huffman codes in JPEG streams, to the bit.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetwarp {

/// Entropy-coded data of a JPEG stream (ITU-T T.81 F.1.2.3), bit by bit up to a marker. Beyond the marker every bit is
/// one and is counted: no code consists of ones alone, so a code that needs them shows.
class JpegBits {
 public:
  explicit JpegBits(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// The next 16 bits. They are not taken: the next call returns them again.
  std::uint32_t peek() {
    if (count_ < 16) fill();
    return static_cast<std::uint32_t>(bits_ >> 48);
  }
  /// Takes bits that `peek` returned. @param count  at most 16
  void drop(int count) {
    bits_ <<= count;
    count_ -= count;
  }
  /// Takes bits and returns them as a number. @param count  0 to 16
  std::uint32_t take(int count) {
    const std::uint32_t value = peek() >> (16 - count);
    drop(count);
    return value;
  }

  /// Whether more bits were taken than there are.
  bool is_short() const { return count_ < behind_; }
  /// Whether all bits were taken, except those that fill up the last byte: ones, of which some encoders add a byte, or
  /// zeros.
  bool is_used_up() {
    fill();
    const int rest = count_ - behind_;
    if (rest < 0 || rest > 15) return false;
    const std::uint64_t value = rest == 0 ? 0 : bits_ >> (64 - rest);
    return value == (std::uint64_t{1} << rest) - 1;
  }
  /// Goes behind the marker at which the data end. @return the marker's low byte; 0: there is no marker
  std::uint8_t next_marker() {
    // Bytes 0xff before a marker are fill bytes.
    while (at_ + 1 < bytes_.size() && bytes_[at_] == 0xff && bytes_[at_ + 1] == 0xff) ++at_;
    bits_ = 0;
    count_ = behind_ = 0;
    if (at_ + 1 >= bytes_.size() || bytes_[at_] != 0xff) return 0;
    at_ += 2;
    return bytes_[at_ - 1];
  }

 private:
  void fill() {
    while (count_ <= 48) {
      std::uint64_t byte = 0xff;
      const bool is_last = at_ + 1 >= bytes_.size();
      if (is_last || (bytes_[at_] == 0xff && bytes_[at_ + 1] != 0)) {
        behind_ += 8;
      } else {
        byte = bytes_[at_];
        at_ += byte == 0xff ? 2 : 1;
      }
      bits_ |= byte << (56 - count_);
      count_ += 8;
    }
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::uint64_t bits_ = 0;      ///< bits that were read and not yet taken, the next one on top
  int count_ = 0, behind_ = 0;  ///< bits in `bits_`, and how many of them lie beyond the end of the data
};

/// A table of Huffman codes (T.81 Annex C, F.2.2.3).
class JpegCodes {
 public:
  /// @param counts  how many codes there are of 1, 2, ... 16 bits
  /// @param values  the value of each code, in the order of the codes
  JpegCodes(std::span<const std::uint8_t, 16> counts, std::span<const std::uint8_t> values) {
    std::uint32_t code = 0;
    std::size_t n = 0;
    for (int length = 1; length <= 16; ++length, code <<= 1) {
      first_[length] = n - code;
      for (int k = 0; k < counts[length - 1]; ++k, ++n, ++code) {
        values_[n] = values[n];
        for (std::uint32_t rest = 0; length <= kQuick && rest < 1u << (kQuick - length); ++rest)
          quick_[(code << (kQuick - length) | rest) & (kQuickSize - 1)] =
              static_cast<std::uint16_t>(length << 8 | values[n]);
      }
      end_[length] = code << (16 - length);
    }
  }
  JpegCodes() = default;

  /// Takes a code. @return its value; -1: no code begins like this
  int next(JpegBits& bits) const {
    const std::uint32_t ahead = bits.peek();
    if (const std::uint16_t quick = quick_[ahead >> (16 - kQuick)]) {
      bits.drop(quick >> 8);
      return quick & 0xff;
    }
    for (int length = kQuick + 1; length <= 16; ++length) {
      if (ahead >= end_[length]) continue;
      bits.drop(length);
      return values_[(first_[length] + (ahead >> (16 - length))) & 0xff];
    }
    return -1;
  }

 private:
  static constexpr int kQuick = 9;
  static constexpr std::size_t kQuickSize = std::size_t{1} << kQuick;
  /// For the next kQuick bits: length and value of a code that is no longer; 0: none is.
  std::array<std::uint16_t, kQuickSize> quick_{};
  std::array<std::uint8_t, 256> values_{};
  std::array<std::size_t, 17> first_{};  ///< by length of code: place in `values_` of the first value, less its code
  /// By length: the code behind the last one of this length, shifted up to 16 bits.
  std::array<std::uint32_t, 17> end_{};
};

}  // namespace tetwarp
