// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmjpeg/djcparam.h>
#include <dcmtk/dcmjpeg/djdijg12.h>
#include <dcmtk/dcmjpeg/djdijg8.h>

#include <algorithm>
#include <array>

#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/codecs/jpeg_scan.h"
#include "io/dicom/pixels/dicom_samples.h"

namespace tetwarp {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kLossless = 0xc3, kEnd = 0xd9, kScan = 0xda;

std::ptrdiff_t count_of_marker(Bytes bytes, std::uint8_t marker) {
  // Coded data hold no marker by chance: after a byte 0xff they have a zero.
  std::ptrdiff_t count = 0;
  for (std::size_t at = 1; at < bytes.size(); ++at) count += bytes[at - 1] == 0xff && bytes[at] == marker;
  return count;
}

/// Checks a stream before it is decoded: DCMTK's decoders make up what a damaged stream lacks, and write as many pixels
/// as it states.
JpegFrame checked_frame(Bytes bytes, const DicomFileHeader& header) {
  // Each scan takes as long to decode as an image; where there are several, ten are usual.
  constexpr std::ptrdiff_t kMostScans = 100;
  const PixelFormat& pixels = header.pixels;
  const JpegFrame frame = jpeg_frame(bytes);
  if (frame.rows != pixels.rows || frame.columns != pixels.columns) {
    refuse_pixels(header, "expected an image of " + size_text(pixels) + ", found one of " + std::to_string(frame.rows) +
                              " x " + std::to_string(frame.columns));
  }
  if (frame.components != 1) refuse_pixels(header, "expected 1 component, found " + std::to_string(frame.components));
  const std::string problem = sample_problem(pixels, {frame.precision});
  if (!problem.empty()) refuse_pixels(header, problem);
  if (count_of_marker(bytes, kEnd) == 0) {
    refuse_pixels(header, "expected an end of image marker within " + std::to_string(bytes.size()) +
                              " bytes, found none: the data are truncated");
  }
  if (const std::ptrdiff_t scans = count_of_marker(bytes, kScan); scans > kMostScans) {
    refuse_pixels(header, "expected at most " + std::to_string(kMostScans) + " scans, found " + std::to_string(scans));
  }
  return frame;
}

std::size_t count_of(const JpegFrame& frame) { return std::size_t(frame.rows) * std::size_t(frame.columns); }

/// Samples as DCMTK decodes them: one byte each up to a precision of 8 bits, a word each above, whatever Bits Allocated
/// says.
class Packed {
 public:
  explicit Packed(const JpegFrame& frame)
      : count_(count_of(frame)), are_bytes_(frame.precision <= 8), room_(are_bytes_ ? (count_ + 1) / 2 : count_) {}

  Uint8* data() { return reinterpret_cast<Uint8*>(room_.data()); }
  Uint32 bytes() const { return static_cast<Uint32>(2 * room_.size()); }
  std::vector<std::uint16_t> samples() && {
    if (!are_bytes_) return std::move(room_);
    return {data(), data() + count_};
  }

 private:
  std::size_t count_;
  bool are_bytes_;
  std::vector<std::uint16_t> room_;
};

std::vector<std::uint16_t> words_of(std::vector<std::uint16_t> samples, const JpegFrame& frame,
                                    const PixelFormat& pixels) {
  std::transform(samples.begin(), samples.end(), samples.begin(), SampleWords(pixels, {frame.precision}));
  return samples;
}

const DJCodecParameter& parameter() {
  static const DJCodecParameter kept(ECC_lossyYCbCr, EDC_never, EUC_never, EPC_default);
  return kept;
}

/// DCMTK's decoder of JPEG, which also counts what libjpeg warns of: bits that are no code, data that are missing or
/// left over. Without the count it would fill up or skip them in silence.
template <class Decoder>
class StrictDecoder final : public Decoder {
 public:
  StrictDecoder() : Decoder(parameter(), OFFalse) {}
  void emitMessage(int level) const override { damages_ += level < 0; }
  int damages() const { return damages_; }

 private:
  mutable int damages_ = 0;
};

template <class Decoder>
void decode_strictly(Bytes bytes, const DicomFileHeader& header, Packed& packed) {
  StrictDecoder<Decoder> decoder;
  OFCondition result = decoder.init();
  if (result.good()) {
    result = decoder.decode(const_cast<Uint8*>(bytes.data()), static_cast<Uint32>(bytes.size()), packed.data(),
                            packed.bytes(), header.pixels.is_signed);
  }
  if (result.bad()) refuse_pixels(header, result.text());
  if (decoder.damages() > 0) {
    refuse_pixels(header, "the coded data are damaged, found at " + std::to_string(decoder.damages()) +
                              (decoder.damages() > 1 ? " places" : " place"));
  }
}

}  // namespace

// Lossless frames are decoded here. Of other frames all codes are read before DCMTK decodes them: DCMTK says nothing of
// a code too many or too few, after which all pixels lie one place off.
std::vector<std::uint16_t> decode_jpeg(Bytes bytes, const DicomFileHeader& header) {
  const JpegFrame frame = checked_frame(bytes, header);
  if (is_one_scan(frame)) {
    std::string problem;
    const JpegScan scan = read_jpeg_scan(bytes, problem);
    const bool is_lossless = frame.marker == kLossless;
    std::vector<std::uint16_t> samples(is_lossless ? count_of(frame) : 0);
    if (problem.empty())
      problem = is_lossless ? decode_lossless(scan, header.pixels.is_signed, samples) : sequential_problem(scan);
    if (!problem.empty()) refuse_pixels(header, problem);
    if (is_lossless) return words_of(std::move(samples), frame, header.pixels);
  }
  Packed packed(frame);
  if (frame.precision <= 8) {
    decode_strictly<DJDecompressIJG8Bit>(bytes, header, packed);
  } else {
    decode_strictly<DJDecompressIJG12Bit>(bytes, header, packed);
  }
  return words_of(std::move(packed).samples(), frame, header.pixels);
}

// DCMTK's decoder of JPEG-LS reads only from DCMTK's own data sets, so that one is made.
std::vector<std::uint16_t> decode_jpeg_ls(Bytes bytes, const DicomFileHeader& header) {
  const JpegFrame frame = checked_frame(bytes, header);
  Packed packed(frame);
  DcmDataset data;
  const auto put = [&](const DcmTagKey& tag, int value) { data.putAndInsertUint16(tag, static_cast<Uint16>(value)); };
  put(DCM_SamplesPerPixel, 1);
  put(DCM_Rows, frame.rows);
  put(DCM_Columns, frame.columns);
  put(DCM_BitsAllocated, frame.precision <= 8 ? 8 : 16);
  put(DCM_BitsStored, frame.precision);
  data.putAndInsertString(DCM_PhotometricInterpretation, "MONOCHROME2");
  auto* sequence = new DcmPixelSequence(DCM_PixelSequenceTag);
  sequence->insert(new DcmPixelItem(DCM_PixelItemTag));  // an empty offset table
  auto* item = new DcmPixelItem(DCM_PixelItemTag);
  item->putUint8Array(bytes.data(), static_cast<unsigned long>(bytes.size()));
  sequence->insert(item);
  auto* element = new DcmPixelData(DCM_PixelData);
  element->putOriginalRepresentation(EXS_JPEGLSLossless, nullptr, sequence);
  data.insert(element);

  Uint32 fragment = 0;
  OFString color_model;
  const OFCondition result =
      element->getUncompressedFrame(&data, 0, fragment, packed.data(), packed.bytes(), color_model);
  if (result.bad()) refuse_pixels(header, result.text());
  return words_of(std::move(packed).samples(), frame, header.pixels);
}

}  // namespace tetwarp
