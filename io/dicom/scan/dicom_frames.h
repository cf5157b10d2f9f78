// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: reading a file that holds several slices.
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

/// A multi-frame CT file: parsed once, up to Pixel Data; its frames are read one by one, by several threads at a time.
/// A data set that is deflated is inflated as a whole.
class FrameFile {
 public:
  /// @throws InputError naming the file for one that is truncated or damaged, or whose frames are not told apart
  explicit FrameFile(const std::filesystem::path& file);

  struct Frame {
    std::unique_ptr<DcmDataset> data;  ///< as of a file of this slice alone, without Pixel Data and place in the file
    DicomFileHeader header;
  };
  /// @throws InputError for a number that no frame has
  Frame frame(int number) const;

  /// Pixels of a frame; those that lie in the file as they are, words of 16 bits, little endian, go to `native`.
  struct Pixels {
    std::span<const std::byte> native;  ///< in the buffer
    std::vector<std::uint16_t> words;   ///< of others, as decode_pixels gives them
  };
  /// @param header  which passed `pixel_problem`
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
  std::size_t rest_ = 0;  ///< bytes behind the place where parsing ended
  DicomFileHeader whole_;
  std::unique_ptr<EnhancedFrames> frames_;
  mutable std::mutex mutex_;                   ///< of DCMTK's objects
  std::optional<std::uint64_t> native_begin_;  ///< of the first frame; none: compressed, or left to DCMTK
  std::vector<FileRange> fragments_;           ///< of all compressed frames
  std::vector<std::size_t> first_fragment_;    ///< of each frame, and the end
};

}  // namespace tetwarp
