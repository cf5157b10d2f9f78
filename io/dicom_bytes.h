#pragma once

// Private to io/: one DICOM file in memory, and what is parsed of it.
#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "io/dicom_header.h"

namespace tetwarp {

/// Memory for one file after the other.
class FileBuffer {
 public:
  /// All bytes of a file; good until the next call. @throws InputError naming the file
  std::span<const std::byte> read(const std::filesystem::path& file);

 private:
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t room_ = 0;
};

struct ParsedSlice {
  std::unique_ptr<DcmFileFormat> format;
  DicomFileHeader header;
  /// Pixel Data where they lie in the file: 16-bit words, little endian, as many as the header says, or the fragments
  /// of compressed frames as long as they are, without the offset table. `format` does not hold them then. Both empty:
  /// they are in `format`.
  std::span<const std::byte> native;
  std::vector<std::span<const std::byte>> fragments;
};

/// Parses a whole file. Pixel Data that end it are left where they are, which spares a copy or two of the most of it;
/// DCMTK makes fragments of odd length longer by a byte.
/// @throws InputError naming the file for one that is truncated or damaged
ParsedSlice parse_slice(std::span<const std::byte> bytes, const std::filesystem::path& file);

}  // namespace tetwarp
