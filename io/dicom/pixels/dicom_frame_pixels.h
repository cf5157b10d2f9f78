// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the frames of an object that is parsed as a whole, whatever their coding.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {

/// Pixels of a multi-frame object of one sample a pixel of 1, 8 or 16 bits. It points into the object's data set.
class FramePixels {
 public:
  /// @param frames  how many frames the object has
  /// @param kind    the kind of object, for messages: "a segmentation"
  /// @throws InputError naming `path` for Pixel Data that are missing or of another length, of a coding that is not
  /// read or loses something, without one fragment for each frame, or of so few bytes that so many pixels are no image
  FramePixels(DcmFileFormat& format, const std::filesystem::path& path, std::size_t frames, const char* kind);

  /// @param number  of the frame, from 0
  /// @return one word a pixel, rows top to bottom
  /// @throws InputError naming the file for a compressed frame that is damaged
  std::vector<std::uint16_t> frame(std::size_t number) const;

 private:
  void find_native(DcmDataset& data, std::size_t frames, const char* kind);
  void find_fragments(DcmDataset& data, std::size_t frames, const char* kind);

  DicomFileHeader header_;
  std::size_t plane_ = 0;
  std::span<const Uint8> bytes_;                       ///< uncompressed pixels of 1 or 8 bits
  std::span<const Uint16> words_;                      ///< uncompressed pixels of 16 bits
  std::vector<std::span<const std::byte>> fragments_;  ///< of compressed frames, one each; of an only frame, all
  bool only_frame_ = false;
};

}  // namespace tetwarp
