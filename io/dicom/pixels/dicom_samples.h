// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the one place where samples become stored values, whether a decoder or a file gave them.
#include <cstdint>
#include <string>

namespace tetwarp {

struct PixelFormat;

/// Where a stored value lies in a word of Pixel Data, and how it keeps its sign (PS3.5 8.1.1).
class StoredBits {
 public:
  /// @param bits_stored, high_bit  1 <= bits_stored <= high_bit + 1 <= 32, which `stored_bits_problem` checks
  StoredBits(int bits_stored, int high_bit, bool is_signed)
      : shift_left_(31 - high_bit), shift_right_(32 - bits_stored), is_signed_(is_signed) {}

  /// The stored value in a word: Bits Stored bits up to High Bit, with their sign. Other bits (overlays, garbage, a
  /// sign that a decoder extended beyond Bits Allocated) are no part of it.
  std::int64_t value(std::uint32_t word) const {
    const std::uint32_t top = word << shift_left_;
    if (is_signed_) return static_cast<std::int32_t>(top) >> shift_right_;
    return top >> shift_right_;
  }

 private:
  int shift_left_, shift_right_;
  bool is_signed_;
};

/// Why a value cannot lie in a word where the header says, "Bits Stored (0028,0101), expected X, found Y"; empty: it
/// can.
std::string stored_bits_problem(int bits_allocated, int bits_stored, int high_bit);

/// What a compressed coding says of its samples.
struct CodedSamples {
  enum class Sign : std::uint8_t {
    none,      ///< numbers from 0
    extended,  ///< two's complement; every bit above the precision is the sign
    unsaid,    ///< bits alone: the coding has no word for signed samples
  };
  int precision = 0;  ///< bits of a sample
  Sign sign = Sign::unsaid;
};

/// Turns samples, as a decoder gives them, into words of 16 bits, as uncompressed Pixel Data would hold them.
///
/// Encoders take one of two things for a sample: the whole word, or the stored value, its Bits Stored alone. The
/// precision says which. Where the two are the same bits (High Bit is Bits Stored - 1), every precision up to Bits
/// Allocated is accepted.
class SampleWords {
 public:
  /// Only for samples for which `sample_problem` returns an empty text.
  SampleWords(const PixelFormat& pixels, const CodedSamples& coded);
  std::uint16_t operator()(std::int32_t sample) const {
    return static_cast<std::uint16_t>(static_cast<std::uint32_t>(sample) << shift_ & mask_);
  }

 private:
  int shift_;
  std::uint32_t mask_;
};

/// Why such samples cannot be turned into stored values, "expected X, found Y"; empty: they can.
std::string sample_problem(const PixelFormat& pixels, const CodedSamples& coded);

}  // namespace tetwarp
