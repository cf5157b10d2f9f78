// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/pixels/dicom_samples.h"

#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {
namespace {

/// Whether a sample is the stored value alone although in a word it lies higher, above other bits.
bool is_value_alone(const PixelFormat& pixels, const CodedSamples& coded) {
  return coded.precision <= pixels.bits_stored && pixels.high_bit + 1 > pixels.bits_stored;
}

}  // namespace

std::string stored_bits_problem(int bits_allocated, int bits_stored, int high_bit) {
  if (bits_stored < 1 || bits_stored > bits_allocated) {
    return "Bits Stored (0028,0101), expected 1 to " + std::to_string(bits_allocated) + ", found " +
           std::to_string(bits_stored);
  }
  if (high_bit < bits_stored - 1 || high_bit >= bits_allocated) {
    return "High Bit (0028,0102), expected " + std::to_string(bits_stored - 1) + ", found " + std::to_string(high_bit);
  }
  return {};
}

SampleWords::SampleWords(const PixelFormat& pixels, const CodedSamples& coded)
    : shift_(is_value_alone(pixels, coded) ? pixels.high_bit + 1 - pixels.bits_stored : 0),
      mask_((1u << pixels.bits_allocated) - 1) {}

std::string sample_problem(const PixelFormat& pixels, const CodedSamples& coded) {
  using Sign = CodedSamples::Sign;
  const std::string found = ", found " + std::to_string(coded.precision);
  if (coded.precision < 1 || coded.precision > pixels.bits_allocated)
    return "expected at most " + std::to_string(pixels.bits_allocated) + " bits a pixel" + found;
  if (coded.precision > pixels.bits_stored && coded.precision <= pixels.high_bit) {
    return "expected samples of the " + std::to_string(pixels.bits_stored) +
           " Bits Stored, or of all bits up to High " + "Bit " + std::to_string(pixels.high_bit) + found + " bits";
  }
  // Coding and header may disagree about the sign. If both have the same number of bits, the bits as they are are the
  // stored value: some encoders take two's complement for numbers without a sign.
  const bool is_signed = coded.sign == Sign::extended;
  if (coded.sign != Sign::unsaid && is_signed != pixels.is_signed && coded.precision != pixels.bits_stored) {
    return std::string("expected ") + (pixels.is_signed ? "signed" : "unsigned") + " samples, found " +
           (is_signed ? "signed" : "unsigned") + " ones of " + std::to_string(coded.precision) + " bits for " +
           std::to_string(pixels.bits_stored) + " Bits Stored";
  }
  return {};
}

}  // namespace tetwarp
