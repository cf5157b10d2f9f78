// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: reads a file that holds several slices.
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "io/dicom/scan/dicom_bytes.h"
#include "io/dicom/scan/dicom_enhanced.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/opened_file.h"

namespace tetwarp {

/// A multi-frame CT file: parsed once, up to Pixel Data; several threads may then read its frames one by one. A
/// deflated data set is inflated as a whole.
class FrameFile {
 public:
  /// @throws InputError naming the file for one that is truncated or damaged, or whose frames cannot be told apart
  explicit FrameFile(const std::filesystem::path& file);

  struct Frame {
    /// What a file of this slice alone would hold, without Pixel Data and without attributes that count frames of this
    /// file.
    std::unique_ptr<DcmDataset> data;
    DicomFileHeader header;
  };
  /// The attributes of a frame. @param number  from 0
  /// @throws InputError for a number that no frame has
  Frame frame(int number) const;

  /// Pixels of a frame. Uncompressed ones, words of 16 bits, little endian, are given as bytes of the file in `native`,
  /// all others in `words`.
  struct Pixels {
    std::span<const std::byte> native;  ///< in the buffer that was given
    std::vector<std::uint16_t> words;   ///< one word a pixel, as decode_pixels gives them
  };
  /// Reads the pixels of a frame.
  /// @param header  the frame's; `pixel_problem` found nothing in it
  /// @param buffer  keeps the bytes that are read
  /// @throws InputError naming the file and the frame
  Pixels pixels(const DicomFileHeader& header, FileBuffer& buffer) const;

 private:
  void parse(const DcmTagKey& until, std::size_t inflated_limit);
  void find_pixels();
  void assign_fragments(const PixelItems& found);
  [[noreturn]] void refuse_cut(std::span<const std::uint64_t> table) const;
  std::vector<std::size_t> starts_in_table(std::span<const std::uint64_t> table, const std::string& name) const;

  std::filesystem::path file_;
  std::shared_ptr<OpenedFile> opened_;
  std::unique_ptr<DcmFileFormat> format_;
  std::size_t rest_ = 0;  ///< bytes of the file behind the place where parsing ended
  DicomFileHeader whole_;
  std::unique_ptr<EnhancedFrames> frames_;
  mutable std::mutex mutex_;  ///< one thread uses DCMTK's objects at a time
  /// Where in the file the first frame's pixels begin; none: they are compressed, or left to DCMTK.
  std::optional<std::uint64_t> native_begin_;
  std::vector<FileRange> fragments_;         ///< fragments of all compressed frames
  std::vector<std::size_t> first_fragment_;  ///< by frame: its first fragment; then the number of fragments
};

}  // namespace tetwarp
