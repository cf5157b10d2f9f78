// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/pixels/dicom_frame_pixels.h"

#include "deform/errors.h"
#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/pixels/dicom_pixels.h"
#include "io/dicom/pixels/dicom_plain_pixels.h"
#include "io/dicom_text.h"

namespace tetwarp {

FramePixels::FramePixels(DcmFileFormat& format, const std::filesystem::path& path, std::size_t frames, const char* kind)
    : header_(header_of(format, path)),
      plane_(static_cast<std::size_t>(header_.pixels.rows) * static_cast<std::size_t>(header_.pixels.columns)) {
  DcmDataset& data = *format.getDataset();
  const bool is_native = pixel_coding(header_.transfer_syntax_uid).value_or(PixelCoding::native) == PixelCoding::native;
  if (is_native || header_.pixels.bits_allocated == 1) {  // no coding that is read has single bits
    find_native(data, frames, kind);
  } else {
    find_fragments(data, frames, kind);
  }
}

void FramePixels::find_native(DcmDataset& data, std::size_t frames, const char* kind) {
  const auto bits = static_cast<std::size_t>(header_.pixels.bits_allocated);
  const std::size_t expected = (plane_ * frames * bits + 7) / 8;
  DcmElement& element = plain_pixels(data, header_.file, expected, kind);
  Uint8* bytes = nullptr;
  Uint16* words = nullptr;
  if (bits == 16 && element.getUint16Array(words).good() && words) {
    words_ = {words, plane_ * frames};
  } else if (bits < 16 && element.getUint8Array(bytes).good() && bytes) {
    bytes_ = {bytes, expected};
  } else if (bits < 16 && element.getUint16Array(words).good() && words) {
    bytes_ = {reinterpret_cast<const Uint8*>(words), expected};
  } else {
    throw InputError(shown(header_.file) + " has no Pixel Data (7FE0,0010) that can be read");
  }
}

void FramePixels::find_fragments(DcmDataset& data, std::size_t frames, const char* kind) {
  constexpr std::size_t kMostPixelsAByte = 10'000;  // of an empty frame of 512 x 512, JPEG-LS makes more than 50 bytes
  fragments_ = fragments_of(data, header_);
  only_frame_ = frames == 1;
  if (is_lossy(header_.transfer_syntax_uid))
    refuse_pixels(header_, std::string("of ") + kind + ", a lossless coding is expected, found " +
                               uid_with_name(header_.transfer_syntax_uid));
  if (only_frame_ ? fragments_.empty() : fragments_.size() != frames)
    refuse_pixels(header_, std::string("of ") + kind + ", one fragment is expected of each frame; found " +
                               plural(fragments_.size(), "fragment") + " of " + plural(frames, "frame"));
  std::size_t stored = 0;
  for (const auto& fragment : fragments_) stored += fragment.size();
  if (plane_ * frames / kMostPixelsAByte > stored)
    refuse_pixels(header_, "expected no more than " + std::to_string(kMostPixelsAByte) + " pixels a byte, found " +
                               plural(stored, "byte") + " for " + plural(frames, "frame") + " of " +
                               std::to_string(plane_) + " pixels");
}

std::vector<std::uint16_t> FramePixels::frame(std::size_t number) const {
  if (!fragments_.empty()) {
    DicomFileHeader header = header_;
    header.frame = static_cast<int>(number);
    return decode_frame(only_frame_ ? std::span(fragments_) : std::span(fragments_).subspan(number, 1), header);
  }
  const std::size_t first = number * plane_;
  if (!words_.empty()) {
    const auto words = words_.subspan(first, plane_);
    return {words.begin(), words.end()};
  }
  std::vector<std::uint16_t> values(plane_);
  // Bits follow one another through all frames, the lowest first.
  const bool is_bit = header_.pixels.bits_allocated == 1;
  for (std::size_t pixel = 0; pixel < plane_; ++pixel) {
    const std::size_t at = first + pixel;
    values[pixel] = static_cast<std::uint16_t>(is_bit ? bytes_[at / 8] >> (at % 8) & 1 : bytes_[at]);
  }
  return values;
}

}  // namespace tetwarp
